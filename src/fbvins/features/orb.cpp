// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/orb.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/features/orb_pattern.hpp"

namespace fbvins {
namespace {

/// FAST threshold at the noise floor, grey values: a cell goes no lower.
constexpr int kMinThreshold = 6;

}  // namespace

OrbExtractor::OrbExtractor(const OrbOptions& options, bool margins) : options_(options), with_margins_(margins) {
  // Features in proportion to the side of the level: coarse levels have less room but survive blur.
  double total = 0;
  for (int l = 0; l < options.levels; ++l) level_share_.push_back(std::pow(kOrbScaleFactor, -l));
  for (const double share : level_share_) total += share;
  for (double& share : level_share_) share /= total;
}

void OrbExtractor::extract(const ImageView& image, OrbFeatures& out, const Mask* mask) {
  out.clear();
  pyramid_.build(image, options_.levels, kOrbScaleFactor);
  double carried = 0;  // what finer levels could not fill goes to coarser ones
  for (int l = 0; l < pyramid_.levels(); ++l) {
    const PyramidLevel& level = pyramid_.level(l);
    carried += level_share_[static_cast<std::size_t>(l)] * options_.max_features;
    fast_.detect(level, kOrbBorder, kMinThreshold, corners_, {mask, pyramid_.scale(l)});
    select(level, static_cast<int>(carried));
    carried -= static_cast<double>(chosen_.size());
    describe(l, out);
  }
}

void OrbExtractor::select(const PyramidLevel& level, int quota) {
  const int columns = (level.width + kFastCell_px - 1) / kFastCell_px;
  candidates_.clear();
  // Only a cell's strongest corners by FAST are here: of the others no Harris score is computed.
  for (const FastCorner& c : corners_) {
    const float harris = harris_score(level, c.x, c.y);
    if (!(harris > 0)) continue;  // an edge
    candidates_.push_back({c.x, c.y, (c.y / kFastCell_px) * columns + c.x / kFastCell_px, harris});
  }
  take_in_rounds(quota);
}

/// First every cell's best, then every cell's second best; within the last round the best of the image.
void OrbExtractor::take_in_rounds(int quota) {
  const auto better = [](const Candidate& a, const Candidate& b) {
    return a.harris != b.harris ? a.harris > b.harris : (a.y != b.y ? a.y < b.y : a.x < b.x);
  };
  std::stable_sort(candidates_.begin(), candidates_.end(),
                   [&](const Candidate& a, const Candidate& b) { return a.cell != b.cell ? a.cell < b.cell : better(a, b); });
  chosen_.clear();
  for (int round = 0; round < kFastPerCell && static_cast<int>(chosen_.size()) < quota; ++round) {
    const std::size_t before = chosen_.size();
    for (std::size_t i = 0, rank = 0; i < candidates_.size(); ++i) {
      rank = i > 0 && candidates_[i].cell == candidates_[i - 1].cell ? rank + 1 : 0;
      if (static_cast<int>(rank) == round) chosen_.push_back(candidates_[i]);
    }
    if (chosen_.size() == before) break;
    if (static_cast<int>(chosen_.size()) <= quota) continue;
    std::sort(chosen_.begin() + static_cast<std::ptrdiff_t>(before), chosen_.end(), better);
    chosen_.resize(static_cast<std::size_t>(quota));
  }
}

/// The level is smoothed around each keypoint, which costs a quarter of smoothing all of it; its half is smoothed as a whole, a
/// quarter as large under patches as large.
void OrbExtractor::describe(int l, OrbFeatures& out) {
  static_assert(kSmoothPatchRadius == kPatternRadius && kSmoothPatchRadius + 3 - ScalePyramid::kBorder <= kOrbBorder);
  if (chosen_.empty()) return;
  const PyramidLevel& level = pyramid_.level(l);
  SmoothPatch patch;
  PyramidLevel smooth_half;
  if (with_margins_) {
    half_.build({level.origin, level.width, level.height, level.stride}, 2);
    // A tiny image has no half: then the surroundings are all alike.
    if (half_.levels() == 2) smooth_half = smooth_level(half_.level(1), smooth_half_, scratch_);
  }
  for (const Candidate& c : chosen_) {
    Keypoint keypoint;
    const Vec2 direction = centroid_direction(level, c.x, c.y);
    keypoint.pixel = pyramid_.to_level0(Vec2(c.x, c.y), l);
    keypoint.level = l;
    keypoint.scale = static_cast<float>(pyramid_.scale(l));
    keypoint.angle_rad = static_cast<float>(std::atan2(direction.y(), direction.x()));
    keypoint.score = c.harris;
    out.keypoints.push_back(keypoint);
    const Comparisons difference =
        compare(smooth_patch(level, c.x, c.y, patch), Vec2(kSmoothPatchRadius, kSmoothPatchRadius), direction);
    out.descriptors.push_back(bits_of(difference));
    if (!with_margins_) continue;
    Margins& margins = out.margins.emplace_back();
    margins_of(difference, margins.of_bit);
    if (smooth_half.origin) margins_of(compare(smooth_half, 0.5 * Vec2(c.x, c.y), direction), margins.around);
  }
}

}  // namespace fbvins
