// SPDX-License-Identifier: Apache-2.0
// The orb frontend, part four: landmarks known again after they were out of view (docs/derivations/known_landmarks.md, K7).
#include <algorithm>

#include "fbvins/frontend/orb_frontend.hpp"

namespace fbvins {
namespace {

/// A track of fewer frames was hardly a landmark.
constexpr int kFewFrames = 4;

}  // namespace

void OrbFrontend::locate(const LandmarkUpdate& update) {
  if (update.reset_counter != reset_counter_) {  // another W
    reset_counter_ = update.reset_counter;
    memory_.clear();
    for (Track& track : tracks_) {
      track.seen_from_W.reset();
      track.p_W.reset();
    }
  }
  for (const LocatedLandmark& located : update.landmarks) {
    const auto track = std::find_if(tracks_.begin(), tracks_.end(), [&](const Track& t) { return t.id == located.track; });
    if (track != tracks_.end()) track->p_W = located.p_W;
    else memory_.locate(located.track, located.p_W);
  }
}

void OrbFrontend::remember(const Track& track) {
  if (!options_.recognition.enabled || !T_WC_ || !track.seen_from_W || !track.inverse_depth || track.age_frames < kFewFrames)
    return;
  RememberedLandmark landmark;
  landmark.track = track.id;
  landmark.descriptor = track.descriptor;
  landmark.raw = track.raw;
  landmark.level = track.level;
  landmark.age_frames = track.age_frames;
  landmark.reference = patches_[track.slot].reference;
  landmark.R_W_reference = T_WC_->R() * landmark.reference.R_now_then;
  landmark.reference_depth_m = 1.0 / (*track.inverse_depth * landmark.reference.depth_ratio);
  landmark.seen_from_W = *track.seen_from_W;
  landmark.p_W = track.p_W;
  landmark.kept = now_;
  memory_.keep(std::move(landmark));
}

/// Tracks of landmarks seen before begin again where descriptor, patch and the others' places agree.
void OrbFrontend::recognise(FrontendStats& stats) {
  if (!T_WC_ || !options_.recognition.enabled) return;
  memory_.expect(*T_WC_, rig_.left, options_.orb, expected_);
  queries_.clear();
  for (const ExpectedLandmark& e : expected_)
    queries_.push_back(
        {e.px, options_.recognition.search_px, e.level, options_.recognition.max_distance, e.landmark->descriptor});
  matcher_.match(queries_, left_features_, found_);

  const auto miss = [&](std::size_t i) -> Vec2 {
    return left_features_.keypoints[static_cast<std::size_t>(found_[i])].pixel - expected_[i].px;
  };
  numbers_.clear();
  numbers_y_.clear();
  for (std::size_t i = 0; i < expected_.size(); ++i) {
    if (found_[i] < 0) continue;
    numbers_.push_back(miss(i).x());
    numbers_y_.push_back(miss(i).y());
  }
  stats.expected = static_cast<int>(expected_.size());
  if (static_cast<int>(numbers_.size()) < options_.recognition.min_together) return;
  // What W has drifted since they were seen moves all of them alike.
  const Vec2 common_miss(median(numbers_), median(numbers_y_));
  for (std::size_t i = 0; i < expected_.size(); ++i) {
    if (found_[i] < 0 || (miss(i) - common_miss).norm() > options_.recognition.agreement_px) continue;
    if (begin_again(expected_[i], static_cast<std::size_t>(found_[i]))) ++stats.recognised;
  }
}

bool OrbFrontend::begin_again(const ExpectedLandmark& expected, std::size_t keypoint_index) {
  if (free_slots_.empty()) return false;
  const Keypoint& keypoint = left_features_.keypoints[keypoint_index];
  const RememberedLandmark& landmark = *expected.landmark;
  PatchReference reference = landmark.reference;
  reference.R_now_then = T_WC_->R().transpose() * landmark.R_W_reference;
  reference.depth_ratio = expected.depth_m / landmark.reference_depth_m;
  const KltResult fine = refiner_.refine(reference, left_, keypoint.pixel, rig_.left, expected.normalised);
  if (!refiner_.accept(fine, keypoint.pixel, keypoint.scale, options_.recognition.min_correlation)) return false;
  Track track;
  track.id = landmark.track;
  track.descriptor = left_features_.descriptors[keypoint_index];
  track.raw = stage_->changes_descriptors() ? raw_left_.descriptors[keypoint_index] : landmark.raw;
  track.level = keypoint.level;
  track.inverse_depth = 1.0 / expected.depth_m;
  track.age_frames = landmark.age_frames;
  track.p_W = landmark.p_W;
  if (!settle(track, fine.px)) return false;
  track.slot = free_slots_.back();
  free_slots_.pop_back();
  patches_[track.slot].reference = reference;
  keypoint_used_[keypoint_index] = 1;
  tracks_.push_back(track);
  memory_.take_out(landmark.track);  // `landmark` ends here
  return true;
}

}  // namespace fbvins
