// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_locator.hpp"

#include <algorithm>

#include "fbvins/core/median.hpp"

namespace fbvins {
namespace {

/// Smallest correlation for a track that is followed by alignment alone.
constexpr double kFollowedCorrelation = 0.85;
/// Farther than this from the prediction, alignment has found something else.
constexpr double kFarthestFollowed_px = 50;
/// A keypoint this near, times its scale, is the track's.
constexpr double kSameFeature_px = 2;

}  // namespace

bool OrbLocator::set_observed_at(const std::optional<Vec2>& px, OrbTrack& track, const OrbView& view) {
  const Vec2 before = track.px;
  if (!px || !set_observed(track, *px, camera_, view)) return false;
  if (track.was_observed) motion_px_.push_back((track.px - before).norm());
  return true;
}

void OrbLocator::follow(OrbTracks& tracks, const OrbView& view, const FrameImages& images, FrontendStats& stats) {
  motion_px_.clear();
  for (OrbTrack& track : tracks) {
    if (!track.was_observed) continue;
    OrbPatches& patches = tracks.patches(track);
    std::optional<Vec2> px = follow_by_alignment(track, patches, images.left());
    if (px && !returns(track, *px, images)) px.reset();
    if (set_observed_at(px, track, view)) keep_patch(track, patches);
    else ++stats.lost_flow;
  }
  stats.median_motion_px = median(motion_px_);
}

void OrbLocator::locate(OrbTracks& tracks, OrbView& view, const FrameImages& images, const std::vector<int>& found,
                        FrontendStats& stats) {
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (found[i] < 0) continue;
    OrbTrack& track = tracks[i];
    const auto k = static_cast<std::size_t>(found[i]);
    const Keypoint& keypoint = view.features.keypoints[k];
    if (track.observed) {
      if ((keypoint.pixel - track.px).norm() < kSameFeature_px * keypoint.scale)
        take_descriptor(track, tracks.patches(track), view, k);
      continue;
    }
    const auto px = place(track, tracks.patches(track), keypoint, images);
    if (!px) ++stats.lost_check;
    if (!set_observed_at(px, track, view)) continue;
    take_descriptor(track, tracks.patches(track), view, k);
    if (track.was_observed) keep_patch(track, tracks.patches(track));
  }
  stats.median_motion_px = median(motion_px_);
}

std::optional<Vec2> OrbLocator::place(OrbTrack& track, const OrbPatches& patches, const Keypoint& keypoint,
                                      const FrameImages& images) {
  const std::optional<Vec2> px = refine_match(track, patches, keypoint, images.left());
  return px && track.was_observed && !returns(track, *px, images) ? std::nullopt : px;
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

std::optional<Vec2> OrbLocator::follow_by_alignment(OrbTrack& track, const OrbPatches& patches, const Pyramid& left) {
  const KltResult newest = klt_align(patches.newest, left, track.px, kOrbAlignmentLevels - 1, 0);
  if (!newest.ok() || newest.correlation < kFollowedCorrelation) return std::nullopt;
  if ((newest.px - track.px).norm() > kFarthestFollowed_px) return std::nullopt;
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

/// The levels that returns() has cut are the finest ones of the track's newest patch.
void OrbLocator::keep_patch(OrbTrack& track, OrbPatches& patches) const {
  track.newest_levels = kNearLevel + 1;
  std::copy_n(back_.levels.begin(), track.newest_levels, patches.newest.levels.begin());
}

/// The forward-backward check: the patch found now, followed into the image before, leads to the track's position there.
bool OrbLocator::returns(const OrbTrack& track, const Vec2& px, const FrameImages& images) {
  if (!back_.cut(images.left(), px, 0, kNearLevel)) return false;
  const KltResult back = klt_align(back_, images.before(), track.previous_px, kNearLevel, 0, kConvergedCheck_px);
  return back.ok() && (back.px - track.previous_px).norm() <= kForwardBackward_px;
}

}  // namespace fbvins
