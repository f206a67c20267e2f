// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_starter.hpp"

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

/// Uncertainty of a new track's position along its weakest direction, px for image noise of one grey value.
constexpr double kMaxUncertainty_px = 0.18;
/// The same where the image has fewer such keypoints than tracks wanted.
constexpr double kMaxUncertaintyFew_px = 3.0;

double weakest_direction_px(const KltLevelTemplate& patch) {
  const double mean = 0.5 * (patch.ihxx + patch.ihyy), half = 0.5 * (patch.ihxx - patch.ihyy);
  return std::sqrt(mean + std::sqrt(half * half + static_cast<double>(patch.ihxy) * patch.ihxy));
}

}  // namespace

std::size_t OrbStarter::cell_of(const Vec2& px) const {
  const int x = std::clamp(static_cast<int>(px.x() * kColumns / camera_.width()), 0, kColumns - 1);
  const int y = std::clamp(static_cast<int>(px.y() * kRows / camera_.height()), 0, kRows - 1);
  return static_cast<std::size_t>(y * kColumns + x);
}

void OrbStarter::list_unused(const OrbView& view) {
  const auto& keypoints = view.features.keypoints;
  strongest_first_.clear();
  for (std::size_t k = 0; k < keypoints.size(); ++k)
    if (view.used[k] == 0) strongest_first_.push_back(k);
  std::stable_sort(strongest_first_.begin(), strongest_first_.end(),
                   [&](std::size_t a, std::size_t b) { return keypoints[a].score > keypoints[b].score; });
}

void OrbStarter::start(OrbTracks& tracks, OrbView& view, const Pyramid& left, FrontendStats& stats) {
  occupied_.clear();
  count_.fill(0);
  for (const OrbTrack& track : tracks) {
    if (!track.observed) continue;
    occupied_.push_back(track.px);
    ++count_[cell_of(track.px)];
  }
  stats.tracked = static_cast<int>(occupied_.size());
  list_unused(view);
  const double usual_px = min_distance_px_, few_px = min_distance_px_ / 2;
  for (const Pass& pass : {Pass{true, kMaxUncertainty_px, usual_px}, Pass{false, kMaxUncertainty_px, usual_px},
                           Pass{true, kMaxUncertaintyFew_px, few_px}, Pass{false, kMaxUncertaintyFew_px, few_px}})
    run(pass, tracks, view, left, stats);
}

void OrbStarter::run(const Pass& pass, OrbTracks& tracks, OrbView& view, const Pyramid& left, FrontendStats& stats) {
  const int share = wanted_ / (kColumns * kRows) + 1;
  const double min2 = pass.min_distance_px * pass.min_distance_px;
  for (const std::size_t k : strongest_first_) {
    if (static_cast<int>(occupied_.size()) >= wanted_) return;
    const Vec2& px = view.features.keypoints[k].pixel;
    if (view.used[k] != 0 || (pass.only_poor_cells && count_[cell_of(px)] >= share)) continue;
    const bool crowded =
        std::any_of(occupied_.begin(), occupied_.end(), [&](const Vec2& other) { return (other - px).squaredNorm() < min2; });
    if (crowded || !start_track(k, pass.max_uncertainty_px, tracks, view, left)) continue;
    occupied_.push_back(px);
    ++count_[cell_of(px)];
    ++stats.detected;
  }
}

bool OrbStarter::start_track(std::size_t k, double max_uncertainty_px, OrbTracks& tracks, OrbView& view,
                             const Pyramid& left) const {
  const Keypoint& keypoint = view.features.keypoints[k];
  const auto normalised = camera_.undistort(keypoint.pixel);
  if (!normalised || tracks.full() || !camera_.inside(keypoint.pixel, kPatchBorder_px)) return false;
  OrbPatches& patches = tracks.free_patches();
  if (!patches.newest.cut(left, keypoint.pixel, 0, 0)) return false;
  if (weakest_direction_px(patches.newest.levels[0]) > max_uncertainty_px) return false;
  patches.newest.extend(left, keypoint.pixel, kOrbAlignmentLevels - 1);
  if (!patches.reference.take(left, keypoint.pixel, camera_, *normalised)) return false;
  OrbTrack track;
  take_descriptor(track, patches, view, k);
  track.px = keypoint.pixel;
  track.normalised = *normalised;
  track.last_seen = view.t;
  track.see(view.index);
  tracks.start(track);
  return true;
}

}  // namespace fbvins
