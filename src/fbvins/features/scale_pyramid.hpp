// SPDX-License-Identifier: Apache-2.0
// Image pyramid with a free scale factor (1.2 for ORB), bilinear, with replicated borders. Pixel p of level l lies on
// (p + 0.5) * scale(l) - 0.5 of level 0. Buffers are reused; not thread-safe.
//
//   ScalePyramid pyramid;
//   pyramid.build(image.view(), 5, 1.2);
//   Vec2 px0 = pyramid.to_level0(Vec2(10, 20), 3);
#pragma once

#include <vector>

#include "fbvins/features/lanes.hpp"
#include "fbvins/features/pyramid.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {

/// From which of sixteen pixels of a row the next few of a smaller one are blended.
struct ShrinkBlock {
  U8x16 left{}, right{};
  int first = 0;  // column of lane 0
};

class ScalePyramid {
 public:
  /// Readable pixels beyond each edge.
  static constexpr int kBorder = 16;

  /// Fewer levels come out where one would be smaller than 64 px.
  void build(const ImageView& image, int levels, double factor);

  int levels() const { return static_cast<int>(levels_.size()); }
  const PyramidLevel& level(int l) const { return levels_[static_cast<std::size_t>(l)]; }
  double scale(int l) const { return scales_[static_cast<std::size_t>(l)]; }
  Vec2 to_level0(const Vec2& px, int l) const { return (px.array() + 0.5) * scale(l) - 0.5; }

 private:
  void shrink(const PyramidLevel& from, double ratio, const PyramidLevel& to, std::uint8_t* origin);

  std::vector<std::uint8_t> pixels_;
  std::vector<PyramidLevel> levels_;
  std::vector<double> scales_;
  std::vector<std::uint8_t> row_;      // after the vertical filter, then its left and right neighbours of each pixel
  std::vector<std::uint8_t> weights_;  // of the right neighbours, out of 128
  std::vector<ShrinkBlock> blocks_;    // of one row
};

/// Smooths a level for BRIEF (7x7, about 1.6 px standard deviation), valid up to 8 px beyond the edges.
/// `out` and `scratch` are resized as needed; the returned view points into `out`.
PyramidLevel smooth_level(const PyramidLevel& level, std::vector<std::uint8_t>& out, std::vector<std::uint16_t>& scratch);

/// Around one pixel of a level, so much of what smooth_level() gives.
inline constexpr int kSmoothPatchRadius = 13;
struct SmoothPatch {
  static constexpr int kSide = 2 * kSmoothPatchRadius + 1, kStride = 2 * kLanes;
  std::uint8_t pixels[kSide * kStride];
};

/// A view of `out` whose pixel (kSmoothPatchRadius, kSmoothPatchRadius) is pixel (x, y) of the level, inside by
/// kSmoothPatchRadius + 3 - kBorder px or more.
PyramidLevel smooth_patch(const PyramidLevel& level, int x, int y, SmoothPatch& out);

}  // namespace fbvins
