// SPDX-License-Identifier: Apache-2.0
// What a printed board looks like, point by point: for simulated images. A value; any thread.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/tag_family.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

class BoardPattern {
 public:
  /// An AprilGrid's tags have a border of so many cells.
  static Result<BoardPattern> create(const Board& board, int border = kLibraryBorder);

  /// Leaves the tag's place white.
  void leave_out(int tag) { tags_.at(static_cast<std::size_t>(tag)) = {}; }

  /// Whether the point (m, in T) is black; nullopt beyond the sheet of paper.
  std::optional<bool> black(double x_m, double y_m) const;

 private:
  BoardPattern(const Board& board, int border) : board_(board), border_(border) {}

  Board board_;
  int border_;
  std::vector<std::optional<TagCells>> tags_;
};

}  // namespace fbvins
