// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/keypoint_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace fbvins {
namespace {

constexpr int kCell_px = 16;
/// Levels of the scale pyramid that a match may be apart.
constexpr int kLevelsApart = 1;

}  // namespace

void KeypointGrid::build(int width, int height, std::span<const Keypoint> keypoints) {
  columns_ = width / kCell_px + 1;
  rows_ = height / kCell_px + 1;
  cell_start_.assign(static_cast<std::size_t>(columns_ * rows_) + 1, 0);
  members_.resize(keypoints.size());
  const auto cell = [&](const Keypoint& k) {
    const int x = std::clamp(static_cast<int>(k.pixel.x()) / kCell_px, 0, columns_ - 1);
    const int y = std::clamp(static_cast<int>(k.pixel.y()) / kCell_px, 0, rows_ - 1);
    return static_cast<std::size_t>(y * columns_ + x);
  };
  for (const Keypoint& k : keypoints) ++cell_start_[cell(k) + 1];
  for (std::size_t c = 1; c < cell_start_.size(); ++c) cell_start_[c] += cell_start_[c - 1];
  next_.assign(cell_start_.begin(), cell_start_.end() - 1);
  for (std::size_t i = 0; i < keypoints.size(); ++i)
    members_[static_cast<std::size_t>(next_[cell(keypoints[i])]++)] = static_cast<std::int32_t>(i);
}

void KeypointGrid::near(const Vec2& px, double radius_px, int level, std::span<const Keypoint> keypoints,
                        std::vector<std::int32_t>& out) const {
  out.clear();
  const auto cell = [](double v, int count) {
    return static_cast<int>(std::clamp(std::floor(v / kCell_px), 0.0, static_cast<double>(count - 1)));
  };
  const int x0 = cell(px.x() - radius_px, columns_), x1 = cell(px.x() + radius_px, columns_);
  const int y0 = cell(px.y() - radius_px, rows_), y1 = cell(px.y() + radius_px, rows_);
  const double radius2 = radius_px * radius_px;
  for (int y = y0; y <= y1; ++y) {
    const std::int32_t first = cell_start_[static_cast<std::size_t>(y * columns_ + x0)];
    const std::int32_t last = cell_start_[static_cast<std::size_t>(y * columns_ + x1) + 1];
    for (std::int32_t i = first; i < last; ++i) {
      const std::int32_t k = members_[static_cast<std::size_t>(i)];
      const Keypoint& keypoint = keypoints[static_cast<std::size_t>(k)];
      if (std::abs(keypoint.level - level) > kLevelsApart) continue;
      if ((keypoint.pixel - px).squaredNorm() <= radius2) out.push_back(k);
    }
  }
}

}  // namespace fbvins
