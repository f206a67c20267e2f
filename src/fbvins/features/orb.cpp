// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/orb.hpp"

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

/// Corners of a cell whose Harris score is computed; the rest is weaker on FAST already.
constexpr int kScoredPerCell = 4;
constexpr int kMostPerCell = 4;
/// Side of a grid cell, on each level.
constexpr int kCell_px = 32;
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

void OrbExtractor::extract(const ImageView& image, OrbFeatures& out) {
  out.clear();
  pyramid_.build(image, options_.levels, kOrbScaleFactor);
  double carried = 0;  // what finer levels could not fill goes to coarser ones
  for (int l = 0; l < pyramid_.levels(); ++l) {
    const PyramidLevel& level = pyramid_.level(l);
    carried += level_share_[static_cast<std::size_t>(l)] * options_.max_features;
    detect_fast(level, kOrbBorder, kMinThreshold, fast_, corners_);
    select(level, static_cast<int>(carried));
    carried -= static_cast<double>(chosen_.size());
    describe(l, out);
  }
}

void OrbExtractor::select(const PyramidLevel& level, int quota) {
  keep_strongest_of_cells(level);
  for (Candidate& c : candidates_) c.harris = harris_score(level, c.x, c.y);
  std::erase_if(candidates_, [](const Candidate& c) { return !(c.harris > 0); });  // edges
  take_in_rounds(quota);
}

/// The cell's threshold sinks from corner to corner until the cell has its share or the floor is reached.
void OrbExtractor::keep_strongest_of_cells(const PyramidLevel& level) {
  const int columns = (level.width + kCell_px - 1) / kCell_px;
  const int rows = (level.height + kCell_px - 1) / kCell_px;
  const auto cells = static_cast<std::size_t>(columns * rows);
  cell_count_.assign(cells, 0);
  candidates_.assign(cells * kScoredPerCell, Candidate{});
  for (const FastCorner& corner : corners_) {
    const int cell = (corner.y / kCell_px) * columns + corner.x / kCell_px;
    Candidate* first = &candidates_[static_cast<std::size_t>(cell) * kScoredPerCell];
    std::int32_t& count = cell_count_[static_cast<std::size_t>(cell)];
    if (count == kScoredPerCell && first[count - 1].strength >= corner.strength) continue;
    int place = std::min(count, kScoredPerCell - 1);
    for (; place > 0 && first[place - 1].strength < corner.strength; --place) first[place] = first[place - 1];
    first[place] = {corner.x, corner.y, cell, corner.strength, 0.0f};
    count = std::min(count + 1, kScoredPerCell);
  }
  std::erase_if(candidates_, [](const Candidate& c) { return c.strength == 0; });
}

/// First every cell's best, then every cell's second best; within the last round the best of the image.
void OrbExtractor::take_in_rounds(int quota) {
  const auto better = [](const Candidate& a, const Candidate& b) {
    return a.harris != b.harris ? a.harris > b.harris : (a.y != b.y ? a.y < b.y : a.x < b.x);
  };
  std::stable_sort(candidates_.begin(), candidates_.end(),
                   [&](const Candidate& a, const Candidate& b) { return a.cell != b.cell ? a.cell < b.cell : better(a, b); });
  chosen_.clear();
  for (int round = 0; round < kMostPerCell && static_cast<int>(chosen_.size()) < quota; ++round) {
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

void OrbExtractor::describe(int l, OrbFeatures& out) {
  if (chosen_.empty()) return;
  const PyramidLevel& level = pyramid_.level(l);
  const PyramidLevel smooth = smooth_level(level, smooth_, scratch_);
  PyramidLevel smooth_half;
  if (with_margins_) {
    half_.build({level.origin, level.width, level.height, level.stride}, 2);
    smooth_half = smooth_level(half_.level(1), smooth_half_, scratch_);
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
    const Comparisons difference = compare(smooth, Vec2(c.x, c.y), direction);
    out.descriptors.push_back(bits_of(difference));
    if (!with_margins_) continue;
    Margins& margins = out.margins.emplace_back();
    margins_of(difference, margins.of_bit);
    margins_of(compare(smooth_half, 0.5 * Vec2(c.x, c.y), direction), margins.around);
  }
}

}  // namespace fbvins
