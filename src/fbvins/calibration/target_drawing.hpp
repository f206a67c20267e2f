// SPDX-License-Identifier: Apache-2.0
// A board as a page to print: true size, with rulers along both edges that show whether the printer kept it. Pure functions.
//
//   Result<Drawing> page = draw_target(board, "A3");
//   write(to_pdf(*page));
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/tag_family.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

/// Millimetres from the page's top left corner, y down.
struct DrawnRectangle {
  double x = 0, y = 0, width = 0, height = 0;
  bool black = true;  ///< otherwise white
};

struct DrawnText {
  double x = 0, y = 0, height = 3;  ///< y of the baseline
  std::string text;
  bool upwards = false;  ///< turned by 90 degrees
};

struct Drawing {
  double width_mm = 0, height_mm = 0;
  std::vector<DrawnRectangle> rectangles;  ///< in the order in which they are painted
  std::vector<DrawnText> texts;
  Vec2 origin_mm = Vec2::Zero();  ///< of T on the page
};

/// The largest whole number of millimetres for Board::size_m with which the board fits on the paper, as metres; 0 if none does.
double largest_size_m(Board board, std::string_view paper);
/// Paper: A4, A3, A2, A1, A0, turned where the board fits better. An error for another name, or a board that does not fit.
/// The tags of an AprilGrid have a border of so many cells, those of a ChArUco board one.
Result<Drawing> draw_target(const Board& board, std::string_view paper, int border = kKalibrBorder);

std::string to_pdf(const Drawing& drawing);
std::string to_svg(const Drawing& drawing);

}  // namespace fbvins
