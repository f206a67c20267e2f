// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_locator.hpp"

#include "fbvins/core/median.hpp"

namespace fbvins {
namespace {

/// Fewest tracks from which the common error of the prediction is estimated.
constexpr std::size_t kFewestForCommonMiss = 8;
/// Smallest correlation for a track that is followed by alignment alone.
constexpr double kFillInCorrelation = 0.85;
/// Farther than this from the prediction, alignment has found something else.
constexpr double kFarthestFillIn_px = 50;
/// A keypoint this near, times its scale, is the track's.
constexpr double kSameFeature_px = 2;

const Keypoint* keypoint_of(const OrbView& view, int found) {
  return found < 0 ? nullptr : &view.features.keypoints[static_cast<std::size_t>(found)];
}

void take_over(OrbTrack& track, OrbView& view, std::size_t keypoint) {
  track.descriptor = view.descriptor(keypoint);
  track.raw = view.raw_descriptor(keypoint);
  track.level = view.features.keypoints[keypoint].level;
  view.used[keypoint] = 1;
}

}  // namespace

/// Median error of the prediction (gyro bias, unknown translation), by which tracks without a keypoint are corrected.
Vec2 OrbLocator::common_miss(const OrbTracks& tracks, const OrbView& view, const std::vector<int>& found) {
  miss_x_px_.clear();
  miss_y_px_.clear();
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (found[i] < 0 || !tracks[i].was_observed || tracks[i].observed) continue;
    const Vec2 miss = keypoint_of(view, found[i])->pixel - tracks[i].px;
    miss_x_px_.push_back(miss.x());
    miss_y_px_.push_back(miss.y());
  }
  if (miss_x_px_.size() < kFewestForCommonMiss) return Vec2::Zero();
  return {median(miss_x_px_), median(miss_y_px_)};
}

bool OrbLocator::set_observed_at(const std::optional<Vec2>& px, OrbTrack& track, const OrbView& view) {
  const Vec2 before = track.px;
  if (!px || !set_observed(track, *px, camera_, view)) return false;
  if (track.was_observed) motion_px_.push_back((track.px - before).norm());
  return true;
}

void OrbLocator::follow(OrbTracks& tracks, const OrbView& view, const FrameImages& images, FrontendStats& stats) {
  motion_px_.clear();
  if (!choices_.follows) return;
  for (OrbTrack& track : tracks) {
    if (!track.was_observed) continue;
    const OrbPatches& patches = tracks.patches(track);
    std::optional<Vec2> px = follow_by_alignment(track, patches, track.px, images.left());
    if (px && !returns(track, *px, images)) px.reset();
    if (!set_observed_at(px, track, view)) ++stats.lost_flow;
  }
  stats.median_motion_px = median(motion_px_);
}

void OrbLocator::locate(OrbTracks& tracks, OrbView& view, const FrameImages& images, const std::vector<int>& found,
                        FrontendStats& stats) {
  const Vec2 missed = common_miss(tracks, view, found);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    OrbTrack& track = tracks[i];
    const Keypoint* keypoint = keypoint_of(view, found[i]);
    if (track.observed) {
      if (keypoint != nullptr && (keypoint->pixel - track.px).norm() < kSameFeature_px * keypoint->scale)
        take_over(track, view, static_cast<std::size_t>(found[i]));
      continue;
    }
    const auto px = place(track, tracks.patches(track), keypoint, track.px + missed, images, stats);
    if (set_observed_at(px, track, view) && keypoint != nullptr) take_over(track, view, static_cast<std::size_t>(found[i]));
  }
  stats.median_motion_px = median(motion_px_);
}

std::optional<Vec2> OrbLocator::place(OrbTrack& track, const OrbPatches& patches, const Keypoint* keypoint,
                                      const Vec2& expected_px, const FrameImages& images, FrontendStats& stats) {
  std::optional<Vec2> px;
  if (keypoint != nullptr) {
    px = choices_.subpixel ? refine_match(track, patches, *keypoint, images.left()) : std::optional<Vec2>(keypoint->pixel);
    if (!px) ++stats.lost_check;
  } else if (track.was_observed && choices_.fill_in && !choices_.follows) {
    px = follow_by_alignment(track, patches, expected_px, images.left());
    if (!px) ++stats.lost_flow;
  }
  if (px && track.was_observed && choices_.subpixel && !returns(track, *px, images)) {
    px.reset();
    ++stats.lost_check;
  }
  return px;
}

/// From a keypoint to the position at which the image matches the track's patches.
std::optional<Vec2> OrbLocator::refine_match(OrbTrack& track, const OrbPatches& patches, const Keypoint& keypoint,
                                             const Pyramid& left) {
  if (!track.was_observed) {
    const KltResult fine = refiner_.refine(patches.reference, left, keypoint.pixel, camera_, track.normalised);
    return refiner_.accept(fine, keypoint.pixel, keypoint.scale) ? std::optional<Vec2>(fine.px) : std::nullopt;
  }
  const KltResult newest = klt_align(patches.newest, left, keypoint.pixel, kNearLevel, 0);
  if (!refiner_.accept(newest, keypoint.pixel, keypoint.scale)) return std::nullopt;
  return hold_to_reference(track, patches, newest.px, left);
}

std::optional<Vec2> OrbLocator::follow_by_alignment(OrbTrack& track, const OrbPatches& patches, const Vec2& expected_px,
                                                    const Pyramid& left) {
  const KltResult newest = klt_align(patches.newest, left, expected_px, kOrbAlignmentLevels - 1, 0);
  if (!newest.ok() || newest.correlation < kFillInCorrelation) return std::nullopt;
  if ((newest.px - expected_px).norm() > kFarthestFillIn_px) return std::nullopt;
  return hold_to_reference(track, patches, newest.px, left);
}

/// The position by the reference, while that still matches. Where the newest patch and the reference disagree, one of them
/// has slid along an edge or onto something else.
std::optional<Vec2> OrbLocator::hold_to_reference(OrbTrack& track, const OrbPatches& patches, const Vec2& newest_px,
                                                  const Pyramid& left) {
  const KltResult fine = refiner_.refine(patches.reference, left, newest_px, camera_, track.normalised);
  track.renew_reference = !refiner_.accept(fine, newest_px, 1.0);
  if (track.renew_reference) return newest_px;
  if ((fine.px - newest_px).norm() > kMaxCreep_px) return std::nullopt;
  return fine.px;
}

/// The forward-backward check: the patch found now, followed into the image before, leads to the track's position there.
bool OrbLocator::returns(const OrbTrack& track, const Vec2& px, const FrameImages& images) {
  if (!back_.cut(images.left(), px, 0, kNearLevel)) return false;
  const KltResult back = klt_align(back_, images.before(), track.previous_px, kNearLevel, 0, kConvergedCheck_px);
  return back.ok() && (back.px - track.previous_px).norm() <= kForwardBackward_px;
}

}  // namespace fbvins
