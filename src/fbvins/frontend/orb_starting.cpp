// SPDX-License-Identifier: Apache-2.0
// The orb frontend, part three: new tracks.
#include <algorithm>
#include <array>
#include <cmath>

#include "fbvins/frontend/orb_frontend.hpp"

namespace fbvins {
namespace {

/// Standard deviation of the position along its weakest direction for image noise of one grey value, px.
double weakest_direction_px(const KltLevelTemplate& patch) {
  const double mean = 0.5 * (patch.ihxx + patch.ihyy), half = 0.5 * (patch.ihxx - patch.ihyy);
  return std::sqrt(mean + std::sqrt(half * half + static_cast<double>(patch.ihxy) * patch.ihxy));
}

}  // namespace

/// New tracks where there are few: first for image cells with less than their share, then anywhere; and where the
/// image has too few sharp corners (dark, blurred, plain walls), its less sharp ones at half the distance, up to
/// half of what is wanted.
void OrbFrontend::start_tracks(FrontendStats& stats) {
  points_a_.clear();
  for (const Track& track : tracks_)
    if (track.in_sight) points_a_.push_back(track.px);
  stats.tracked = static_cast<int>(points_a_.size());

  constexpr int kColumns = 8, kRows = 5;
  const auto cell = [&](const Vec2& px) {
    const int x = std::clamp(static_cast<int>(px.x() * kColumns / left_.width()), 0, kColumns - 1);
    const int y = std::clamp(static_cast<int>(px.y() * kRows / left_.height()), 0, kRows - 1);
    return static_cast<std::size_t>(y * kColumns + x);
  };
  std::array<int, kColumns * kRows> count{};
  for (const Vec2& px : points_a_) ++count[cell(px)];
  const int share = options_.max_features / (kColumns * kRows) + 1;

  order_.clear();
  for (std::size_t k = 0; k < left_features_.size(); ++k)
    if (keypoint_used_[k] == 0) order_.push_back(k);
  const auto& keypoints = left_features_.keypoints;
  std::stable_sort(order_.begin(), order_.end(),
                   [&](std::size_t a, std::size_t b) { return keypoints[a].score > keypoints[b].score; });
  struct Pass {
    bool only_poor_cells;
    double max_uncertainty_px, min_distance_px;
    int wanted;
  };
  const double usual_px = options_.min_distance_px, few_px = options_.min_distance_px / 2;
  const Pass passes[] = {{true, options_.max_uncertainty_px, usual_px, options_.max_features},
                         {false, options_.max_uncertainty_px, usual_px, options_.max_features},
                         {true, options_.max_uncertainty_few_px, few_px, options_.max_features / 2},
                         {false, options_.max_uncertainty_few_px, few_px, options_.max_features / 2}};
  for (const Pass& pass : passes) {
    const double min2 = pass.min_distance_px * pass.min_distance_px;
    for (const std::size_t k : order_) {
      if (static_cast<int>(points_a_.size()) >= pass.wanted) break;
      const Keypoint& keypoint = keypoints[k];
      if (keypoint_used_[k] != 0 || (pass.only_poor_cells && count[cell(keypoint.pixel)] >= share)) continue;
      const bool crowded = std::any_of(points_a_.begin(), points_a_.end(),
                                       [&](const Vec2& other) { return (other - keypoint.pixel).squaredNorm() < min2; });
      if (crowded || !start_track(k, pass.max_uncertainty_px)) continue;
      keypoint_used_[k] = 1;
      points_a_.push_back(keypoint.pixel);
      ++count[cell(keypoint.pixel)];
      ++stats.detected;
    }
  }
}

bool OrbFrontend::start_track(std::size_t index, double max_uncertainty_px) {
  const Keypoint& keypoint = left_features_.keypoints[index];
  const auto normalised = rig_.left.undistort(keypoint.pixel);
  if (!normalised || free_slots_.empty() || !rig_.left.inside(keypoint.pixel, kBorder_px)) return false;
  Track track;
  track.slot = free_slots_.back();
  Patches& patches = patches_[track.slot];
  if (!patches.newest.cut(left_, keypoint.pixel, 0, kAlignmentLevels - 1)) return false;
  if (weakest_direction_px(patches.newest.levels[0]) > max_uncertainty_px) return false;
  if (!patches.reference.take(left_, keypoint.pixel, rig_.left, *normalised)) return false;
  free_slots_.pop_back();
  track.id = TrackId{next_track_++};
  track.descriptor = left_features_.descriptors[index];
  if (stage_->changes_descriptors()) track.raw = raw_left_.descriptors[index];
  track.level = keypoint.level;
  track.px = keypoint.pixel;
  track.normalised = *normalised;
  track.last_seen = now_;
  track.in_sight = true;
  track.history[static_cast<std::size_t>(frame_count_) % kHistory] = {track.normalised, frame_count_};
  tracks_.push_back(track);
  return true;
}

}  // namespace fbvins
