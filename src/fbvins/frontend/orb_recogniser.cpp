// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_recogniser.hpp"

#include <algorithm>

#include "fbvins/core/median.hpp"

namespace fbvins {
namespace {

/// Tracks of fewer images are not remembered.
constexpr int kFewestFramesOfALandmark = 4;
/// Search radius around the predicted position of a landmark.
constexpr double kSearch_px = 15;
constexpr int kMaxLandmarkDistance_bits = 50;
/// Fewer matches than this in one image may be chance.
constexpr int kFewestTogether = 4;
/// Largest deviation of one from the median prediction error.
constexpr double kAgreement_px = 4;
/// With the patch with which the track began.
constexpr double kMinCorrelation = 0.7;

}  // namespace

void OrbRecogniser::locate(const LandmarkUpdate& update, OrbTracks& tracks) {
  for (const LocatedLandmark& located : update.landmarks) {
    const auto track = std::find_if(tracks.begin(), tracks.end(), [&](const OrbTrack& t) { return t.id == located.track; });
    if (track != tracks.end()) track->p_G = located.p_G;
    else memory_.locate(located.track, located.p_G);
  }
}

void OrbRecogniser::clear(OrbTracks& tracks) {
  memory_.clear();
  for (OrbTrack& track : tracks) {
    track.seen_from_G.reset();
    track.p_G.reset();
  }
}

bool OrbRecogniser::wants(const OrbTrack& track, const OrbView& view) const {
  return options_.enabled && view.T_GC && track.seen_from_G && track.inverse_depth &&
         track.age_frames >= kFewestFramesOfALandmark;
}

void OrbRecogniser::remember(const OrbTrack& track, const PatchReference& reference, const OrbView& view, Time now) {
  if (!wants(track, view)) return;
  RememberedLandmark landmark;
  landmark.track = track.id;
  landmark.descriptor = track.descriptor;
  landmark.raw = track.raw;
  landmark.level = track.level;
  landmark.age_frames = track.age_frames;
  landmark.reference = reference;
  landmark.R_G_reference = view.T_GC->R() * reference.R_now_then;
  landmark.reference_depth_m = 1.0 / (*track.inverse_depth * reference.depth_ratio);
  landmark.seen_from_G = *track.seen_from_G;
  landmark.p_G = track.p_G;
  landmark.kept = now;
  memory_.keep(std::move(landmark));
}

void OrbRecogniser::recognise(OrbTracks& tracks, OrbView& view, const Pyramid& left, OrbImprover& improver,
                              FrontendStats& stats) {
  if (!view.T_GC || !options_.enabled) return;
  memory_.expect(*view.T_GC, camera_, levels_, expected_);
  queries_.clear();
  for (const ExpectedLandmark& e : expected_)
    queries_.push_back({e.px, kSearch_px, e.level, kMaxLandmarkDistance_bits, e.landmark->descriptor, e.landmark->raw});
  improver.improve_similar(queries_, view);
  matcher_.match(queries_, view.comparable(), view.grid, found_);

  const auto miss = [&](std::size_t i) -> Vec2 {
    return view.features.keypoints[static_cast<std::size_t>(found_[i])].pixel - expected_[i].px;
  };
  miss_x_px_.clear();
  miss_y_px_.clear();
  for (std::size_t i = 0; i < expected_.size(); ++i) {
    if (found_[i] < 0) continue;
    miss_x_px_.push_back(miss(i).x());
    miss_y_px_.push_back(miss(i).y());
  }
  stats.expected = static_cast<int>(expected_.size());
  if (static_cast<int>(miss_x_px_.size()) < kFewestTogether) return;
  // The drift since they were observed moves all of them alike.
  const Vec2 common_miss(median(miss_x_px_), median(miss_y_px_));
  for (std::size_t i = 0; i < expected_.size(); ++i) {
    if (found_[i] < 0 || (miss(i) - common_miss).norm() > kAgreement_px) continue;
    if (resume(expected_[i], static_cast<std::size_t>(found_[i]), tracks, view, left)) ++stats.recognised;
  }
}

bool OrbRecogniser::resume(const ExpectedLandmark& expected, std::size_t k, OrbTracks& tracks, OrbView& view,
                           const Pyramid& left) {
  if (tracks.full()) return false;
  const Keypoint& keypoint = view.features.keypoints[k];
  const RememberedLandmark& landmark = *expected.landmark;
  PatchReference reference = landmark.reference;
  reference.R_now_then = view.T_GC->R().transpose() * landmark.R_G_reference;
  reference.depth_ratio = expected.depth_m / landmark.reference_depth_m;
  const KltResult fine = refiner_.refine(reference, left, keypoint.pixel, camera_, expected.normalised);
  if (!refiner_.accept(fine, keypoint.pixel, keypoint.scale, kMinCorrelation)) return false;
  OrbTrack track;
  track.id = landmark.track;
  track.inverse_depth = 1.0 / expected.depth_m;
  track.age_frames = landmark.age_frames;
  track.p_G = landmark.p_G;
  if (!set_observed(track, fine.px, camera_, view)) return false;
  OrbPatches& patches = tracks.free_patches();
  patches.reference = reference;
  take_descriptor(track, patches, view, k);
  tracks.resume(track);
  memory_.take_out(landmark.track);  // `landmark` ends here
  return true;
}

}  // namespace fbvins
