// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/fast_cells.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>

namespace fbvins {
namespace {

constexpr int kSide = kFastCell_px;

}  // namespace

void FastCells::detect(const PyramidLevel& level, int border, int floor, std::vector<FastCorner>& out,
                       const HiddenOnLevel& hidden) {
  assert(border >= 4);
  out.clear();
  level_ = level, border_ = border, hidden_ = hidden;
  floor_ = static_cast<std::uint8_t>(floor);
  count_ = level.width - 2 * border;
  if (count_ <= 0 || level.height <= 2 * border) return;
  columns_ = (level.width + kSide - 1) / kSide;
  // Strengths one column and one row beyond the wanted area, for the neighbours' comparison.
  const std::size_t blocks = static_cast<std::size_t>(count_ + 2 + kFastBlock - 1) / kFastBlock;
  pitch_ = (blocks + 1) * kFastBlock;
  rows_.assign(4 * pitch_ + kFastBlock, 0);
  found_.assign(3 * blocks, 0);
  limits_.assign(static_cast<std::size_t>(columns_ * kSide) + 2 * kFastBlock, floor_);
  cells_.assign(static_cast<std::size_t>(columns_ * ((level.height + kSide - 1) / kSide)), Cell{});

  fill(border - 1);
  fill(border);
  for (int y = border; y < level.height - border; ++y) {
    if (y % kSide == 0) std::fill(limits_.begin(), limits_.end(), floor_);  // the row above has set some again
    fill(y + 1);
    collect(y);
  }
  for (const Cell& cell : cells_) out.insert(out.end(), cell.strongest, cell.strongest + cell.count);
}

/// Strengths of row y. With its first row, which is filled before the row above is collected, a row of cells has no limits yet.
void FastCells::fill(int y) {
  if (y % kSide == 0) std::fill(limits_.begin(), limits_.end(), floor_);
  fast_strength_row(level_.row(y) + border_ - 1, level_.stride, count_ + 2, limits_.data() + border_ - 1, row(y), found(y));
}

/// Few pixels remain: eight at a time are tested as one integer.
void FastCells::collect(int y) {
  static_assert(std::endian::native == std::endian::little, "the lowest byte must be the first pixel");
  std::uint8_t* left = row(2) + pitch_;
  const std::uint8_t* found_here = found(y);
  keep_local_maxima(row(y + 2), row(y), row(y + 1), count_ + 2, limits_.data() + border_ - 1, found_here, left);
  for (int block = 0; block < count_ + 2; block += kFastBlock) {
    if (!found_here[block / kFastBlock]) continue;
    for (int first = block; first < block + kFastBlock; first += 8) {
      std::uint64_t eight;
      std::memcpy(&eight, left + first, sizeof(eight));
      while (eight != 0) {
        const int k = std::countr_zero(eight) / 8, x = border_ - 1 + first + k;
        if (x >= border_ && x < border_ + count_) keep(x, y, static_cast<std::uint8_t>(eight >> (8 * k)));
        eight &= ~(std::uint64_t{0xff} << (8 * k));
      }
    }
  }
}

/// Inserts a corner into its cell, the strongest first. Once the cell is full, its weakest corner is the limit that others must
/// exceed.
void FastCells::keep(int x, int y, std::uint8_t strength) {
  const int column = x / kSide;
  Cell& cell = cells_[static_cast<std::size_t>((y / kSide) * columns_ + column)];
  FastCorner* first = cell.strongest;
  if (cell.count == kFastPerCell && first[kFastPerCell - 1].strength >= strength) return;
  if (hidden_.at(x, y)) return;
  int place = std::min(cell.count, kFastPerCell - 1);
  for (; place > 0 && first[place - 1].strength < strength; --place) first[place] = first[place - 1];
  first[place] = {static_cast<std::int16_t>(x), static_cast<std::int16_t>(y), strength};
  cell.count = std::min(cell.count + 1, kFastPerCell);
  if (cell.count < kFastPerCell) return;
  std::memset(&limits_[static_cast<std::size_t>(column * kSide)], first[kFastPerCell - 1].strength, kSide);
}

}  // namespace fbvins
