// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/board_pattern.hpp"

#include <cmath>

namespace fbvins {

Result<BoardPattern> BoardPattern::create(const Board& board, int border) {
  BoardPattern out(board, border);
  if (board.kind == BoardKind::charuco) return Error{ErrorCode::unsupported, "ChArUco boards cannot be rendered"};
  if (board.kind == BoardKind::chessboard) return out;
  for (int id = 0; id < board.columns * board.rows; ++id) {
    Result<TagCells> cells = tag_cells(id);
    if (!cells) return cells.error();
    out.tags_.emplace_back(*cells);
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
  const int cells = cells_across(border_), cell_x = std::min(cells - 1, static_cast<int>((x - gap) / size * cells)),
            cell_y = std::min(cells - 1, static_cast<int>((y - gap) / size * cells));
  const auto& tag = tags_[static_cast<std::size_t>(row * board_.columns + column)];
  return tag && is_black(*tag, border_, cells - 1 - cell_y, cell_x);  // y is upwards, rows from the top
}

}  // namespace fbvins
