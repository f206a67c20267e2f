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
  rows_.assign(4 * pitch_, 0);
  skip_.assign(blocks, floor_);
  limits_.assign(static_cast<std::size_t>(columns_ * kSide), floor_);
  cell_limits_.assign(static_cast<std::size_t>(columns_) + 2, floor_);
  cells_.assign(static_cast<std::size_t>(columns_ * ((level.height + kSide - 1) / kSide)), Cell{});

  fill(border - 1);
  fill(border);
  for (int y = border; y < level.height - border; ++y) {
    if (y % kSide == 0) {
      std::fill(limits_.begin(), limits_.end(), floor_);
      std::fill(cell_limits_.begin(), cell_limits_.end(), floor_);
    }
    fill(y + 1);
    collect(y);
  }
  for (const Cell& cell : cells_) out.insert(out.end(), cell.strongest, cell.strongest + cell.count);
}

/// Strengths of row y, skipping blocks in which no pixel can exceed the limits of the cells that it belongs to or is compared in.
/// The last row of a cell and the first row of the next are compared with one another, before the lower cell has a limit: there
/// the floor counts.
void FastCells::fill(int y) {
  const bool last = y % kSide == kSide - 1 || y % kSide == 0;
  // a block and the pixels beside it touch these cells
  const std::uint8_t* cell = cell_limits_.data() + (border_ - 2) / kSide;
  const int more = (border_ - 1 + kFastBlock) / kSide - (border_ - 2) / kSide;
  for (std::size_t b = 0; b < skip_.size(); ++b)
    skip_[b] = last ? floor_ : std::min({cell[b], cell[b + 1], cell[b + static_cast<std::size_t>(more)]});
  fast_strength_row_above(level_.row(y) + border_ - 1, level_.stride, count_ + 2, skip_.data(),
                          rows_.data() + static_cast<std::size_t>(y % 3) * pitch_);
}

/// Few pixels remain: eight at a time are tested as one integer.
void FastCells::collect(int y) {
  static_assert(std::endian::native == std::endian::little, "the lowest byte must be the first pixel");
  const auto row = [&](int r) { return rows_.data() + static_cast<std::size_t>(r % 3) * pitch_ + 1; };
  std::uint8_t* left = rows_.data() + 3 * pitch_;
  keep_local_maxima(row(y + 2), row(y), row(y + 1), count_, limits_.data() + border_, left);
  for (int block = 0; block < count_; block += 8) {
    std::uint64_t eight;
    if (block % 32 == 0) {  // most blocks are empty
      std::uint64_t words[4];
      std::memcpy(words, left + block, sizeof(words));
      if ((words[0] | words[1] | words[2] | words[3]) == 0) {
        block += 24;
        continue;
      }
    }
    std::memcpy(&eight, left + block, sizeof(eight));
    while (eight != 0) {
      const int k = std::countr_zero(eight) / 8;
      keep(border_ + block + k, y, static_cast<std::uint8_t>(eight >> (8 * k)));
      eight &= ~(std::uint64_t{0xff} << (8 * k));
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
  cell_limits_[static_cast<std::size_t>(column)] = first[kFastPerCell - 1].strength;
  std::memset(&limits_[static_cast<std::size_t>(column * kSide)], first[kFastPerCell - 1].strength, kSide);
}

}  // namespace fbvins
