// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/board_pattern.hpp"

#include <cmath>

namespace fbvins {

Result<BoardPattern> BoardPattern::create(const Board& board) {
  BoardPattern out(board);
  if (board.kind == BoardKind::charuco) return Error{ErrorCode::unsupported, "ChArUco boards cannot be rendered"};
  if (board.kind == BoardKind::chessboard) return out;
  for (int id = 0; id < board.columns * board.rows; ++id) {
    Result<TagCells> cells = tag_cells(id);
    if (!cells) return cells.error();
    out.tags_.push_back(*cells);
  }
  return out;
}

std::optional<bool> BoardPattern::black(double x_m, double y_m) const {
  const double size = board_.size_m;
  if (board_.kind == BoardKind::chessboard) {
    const double column = std::floor(x_m / size) + 1, row = std::floor(y_m / size) + 1;
    if (column < -1 || row < -1 || column > board_.columns + 1 || row > board_.rows + 1) return std::nullopt;
    const bool inside = column >= 0 && row >= 0 && column <= board_.columns && row <= board_.rows;
    return inside && std::fmod(column + row, 2) == 0;
  }
  const double gap = board_.spacing * size, pitch = size + gap;
  // A cell of the grid begins with the gap and its square at the lower left.
  const double column = std::floor((x_m + gap) / pitch), row = std::floor((y_m + gap) / pitch);
  const double x = x_m + gap - column * pitch, y = y_m + gap - row * pitch;
  if (column < -1 || row < -1 || column > board_.columns || row > board_.rows) return std::nullopt;
  const bool square = column >= 0 && row >= 0 && x < gap && y < gap;
  if (column < 0 || row < 0 || column == board_.columns || row == board_.rows || x < gap || y < gap) return square;
  const int cell_x = std::min(7, static_cast<int>((x - gap) / size * 8)),
            cell_y = std::min(7, static_cast<int>((y - gap) / size * 8));
  return tags_[static_cast<std::size_t>(row * board_.columns + column)][7 - cell_y][cell_x];  // y is upwards, rows from the top
}

}  // namespace fbvins
