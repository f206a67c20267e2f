// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/board.hpp"

#include <fmt/format.h>

namespace fbvins {

int Board::corner_count() const {
  if (kind == BoardKind::aprilgrid) return 4 * columns * rows;
  return kind == BoardKind::charuco ? (columns - 1) * (rows - 1) : columns * rows;
}

Vec3 Board::corner(int index) const {
  if (kind != BoardKind::aprilgrid) {
    const int in_a_row = kind == BoardKind::charuco ? columns - 1 : columns;
    return {size_m * (index % in_a_row), size_m * (index / in_a_row), 0};
  }
  const int tag = index / 4, k = index % 4;
  const double pitch_m = size_m * (1 + spacing);
  return {pitch_m * (tag % columns) + (k == 1 || k == 2 ? size_m : 0), pitch_m * (tag / columns) + (k >= 2 ? size_m : 0), 0};
}

std::string Board::describe() const {
  const char* name = kind == BoardKind::aprilgrid ? "AprilGrid" : kind == BoardKind::charuco ? "ChArUco" : "chessboard";
  const char* parts = kind == BoardKind::aprilgrid ? "tags" : kind == BoardKind::charuco ? "squares" : "inner corners, squares";
  return fmt::format("{}, {} x {} {} of {:g} mm", name, columns, rows, parts, 1e3 * size_m);
}

}  // namespace fbvins
