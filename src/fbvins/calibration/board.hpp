// SPDX-License-Identifier: Apache-2.0
// A calibration board: where its corners are. T is the board's frame: origin at its first corner, x along a row, y along a
// column, z = x cross y. An AprilGrid as Kalibr and `fbvins target` print it has tag 0 at the bottom left and rows that count
// upwards, so that z points to a viewer of the printed side. Values; any thread.
//
//   Board board{.columns = 6, .rows = 6, .size_m = 0.088, .spacing = 0.3};
//   Vec3 p_T = board.corner(17);   // metres, z = 0
#pragma once

#include <string>

#include "fbvins/geometry/pose.hpp"

namespace fbvins {

/// The board's frame.
struct T {};

enum class BoardKind { aprilgrid, charuco, chessboard };

struct Board {
  BoardKind kind = BoardKind::aprilgrid;
  int columns = 6, rows = 6;  ///< AprilGrid: tags; ChArUco: squares; chessboard: inner corners (the first one is the origin)
  double size_m = 0.088;      ///< AprilGrid: edge of a tag; otherwise edge of a square
  double spacing = 0.3;       ///< AprilGrid: gap between tags as a part of size_m; ChArUco: marker's edge as a part of size_m

  int corner_count() const;
  /// Position of a corner, m. AprilGrid: corner = 4 * tag + k, k counting (0,0) (s,0) (s,s) (0,s), tags row by row from the
  /// origin; otherwise inner corners row by row.
  Vec3 corner(int index) const;
  bool operator==(const Board&) const = default;

  /// "AprilGrid, 6 x 6 tags of 88 mm".
  std::string describe() const;
};

}  // namespace fbvins
