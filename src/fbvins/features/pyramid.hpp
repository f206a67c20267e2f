// SPDX-License-Identifier: Apache-2.0
// Half-size image pyramid with replicated borders, for Lucas-Kanade and corner detection.
// Pixel (x, y) of level l lies on pixel (x, y) * 2^l of level 0. Buffers are reused by build(), so one
// Pyramid held over many frames allocates only when the image size changes. Not thread-safe.
//
//   Pyramid pyramid;
//   pyramid.build(image.view(), 4);
//   const PyramidLevel& half = pyramid.level(1);
//   uint8_t value = half.row(10)[20];          // valid from -kPyramidBorder to size + kPyramidBorder - 1
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "fbvins/types/image.hpp"

namespace fbvins {

/// Readable pixels beyond each edge of every level: a 16 px patch whose centre is inside stays inside.
inline constexpr int kPyramidBorder = 16;
inline constexpr int kMaxPyramidLevels = 6;

/// Bytes from row to row of a level with borders so wide.
inline std::ptrdiff_t padded_stride(int width, int border_px) { return (width + 2 * border_px + 63) / 64 * 64; }

struct PyramidLevel {
  const std::uint8_t* origin = nullptr;  ///< pixel (0, 0)
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;

  const std::uint8_t* row(int y) const { return origin + y * stride; }
};

class Pyramid {
 public:
  Pyramid() = default;
  Pyramid(Pyramid&&) = default;  // levels point into the moved buffer
  Pyramid& operator=(Pyramid&&) = default;
  Pyramid(const Pyramid&) = delete;
  Pyramid& operator=(const Pyramid&) = delete;

  /// Copies the image and computes `levels` levels (fewer if a level would be smaller than 16 px).
  void build(const ImageView& image, int levels);
  void clear() { levels_.clear(); }

  bool empty() const { return levels_.empty(); }
  int levels() const { return static_cast<int>(levels_.size()); }
  const PyramidLevel& level(int l) const { return levels_[static_cast<std::size_t>(l)]; }
  int width() const { return empty() ? 0 : levels_[0].width; }
  int height() const { return empty() ? 0 : levels_[0].height; }

 private:
  std::vector<std::uint8_t> pixels_;        // all levels, with their borders
  std::vector<std::uint16_t> column_sums_;  // one row of the vertical filter
  std::vector<PyramidLevel> levels_;
};

/// Mean grey value, from every second row of level 1 (level 0 if it is alone); 0 for an empty pyramid.
double mean_brightness(const Pyramid& pyramid);

}  // namespace fbvins
