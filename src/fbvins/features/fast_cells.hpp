// SPDX-License-Identifier: Apache-2.0
// The strongest FAST corners of each cell of a level: of all that are the strongest of their 3x3 neighbourhood, looked for only
// where they exceed what their cell already has. One instance, one thread; buffers are reused.
//
//   FastCells cells;
//   cells.detect(level, 12, 6, corners);
#pragma once

#include <cstdint>
#include <vector>

#include "fbvins/camera/mask.hpp"
#include "fbvins/features/fast.hpp"
#include "fbvins/features/pyramid.hpp"

namespace fbvins {

/// Side of a cell, and the corners kept of one.
inline constexpr int kFastCell_px = 32, kFastPerCell = 4;

/// What a mask hides of a level: pixel p of the level lies on (p + 0.5) * scale - 0.5 of the mask.
struct HiddenOnLevel {
  const Mask* mask = nullptr;
  double scale = 1;

  bool at(int x, int y) const {
    return mask != nullptr && mask->hides(Vec2((x + 0.5) * scale - 0.5, (y + 0.5) * scale - 0.5), kMaskMargin_px);
  }
};

class FastCells {
 public:
  /// Corners stronger than `floor`, at least `border` (>= 4) px from the edges; cell by cell, the strongest first, of equal ones
  /// the first in reading order. What is hidden takes no place in a cell.
  void detect(const PyramidLevel& level, int border, int floor, std::vector<FastCorner>& out, const HiddenOnLevel& hidden = {});

 private:
  struct Cell {
    int count = 0;
    FastCorner strongest[kFastPerCell];
  };

  void fill(int y);
  void collect(int y);
  void keep(int x, int y, std::uint8_t strength);
  std::uint8_t* row(int y) { return rows_.data() + static_cast<std::size_t>(y % 3) * pitch_ + kFastBlock; }
  std::uint8_t* found(int y) { return found_.data() + static_cast<std::size_t>(y % 3) * (found_.size() / 3); }

  // of the level in work
  PyramidLevel level_{};
  HiddenOnLevel hidden_;
  int border_ = 0, count_ = 0, columns_ = 0;
  std::uint8_t floor_ = 0;
  std::size_t pitch_ = 0;
  std::vector<std::uint8_t> rows_;    // three rows of strengths, one of local maxima, from one column left of the border on
  std::vector<std::uint8_t> found_;   // of each block of three rows: whether a strength exceeds its limit
  std::vector<std::uint8_t> limits_;  // of each column: its cell takes only corners stronger than this
  std::vector<Cell> cells_;
};

}  // namespace fbvins
