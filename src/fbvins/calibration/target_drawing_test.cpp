// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/target_drawing.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace target_drawing_test {

Board chessboard() { return {.kind = BoardKind::chessboard, .columns = 7, .rows = 5, .size_m = 0.02, .spacing = 0}; }

TEST(TargetDrawing, IsTrueToSize) {
  const auto page = draw_target(chessboard(), "A4");
  ASSERT_TRUE(page) << page.error().message;
  EXPECT_EQ(page->width_mm, 210);
  EXPECT_EQ(page->height_mm, 297);
  EXPECT_EQ(page->rectangles[0].width, 20);
  EXPECT_NEAR(page->origin_mm.x(), page->rectangles[0].x + 20, 1e-9);
  const std::string pdf = to_pdf(*page), svg = to_svg(*page);
  EXPECT_NE(pdf.find("/MediaBox [0 0 595.2756 841.8898]"), std::string::npos);
  EXPECT_NE(pdf.find("/PrintScaling /None"), std::string::npos);
  EXPECT_NE(pdf.find("2.834646 0 0 2.834646 0 0 cm"), std::string::npos);
  EXPECT_NE(svg.find("width=\"210mm\" height=\"297mm\" viewBox=\"0 0 210 297\""), std::string::npos);
  EXPECT_NE(svg.find("mm from end to end"), std::string::npos);
}

TEST(TargetDrawing, ThePdfsTableOfObjectsIsRight) {
  const std::string pdf = to_pdf(*draw_target(chessboard(), "A3"));
  const std::size_t start = std::stoul(pdf.substr(pdf.rfind("startxref") + 10));
  EXPECT_EQ(pdf.substr(start, 5), "xref\n");
  for (int object = 1; object <= 5; ++object) {
    const std::size_t offset = std::stoul(pdf.substr(start + 9 + 20 * object, 10));
    EXPECT_EQ(pdf.substr(offset, 7), std::to_string(object) + " 0 obj");
  }
}

TEST(TargetDrawing, TheLargestSizeFitsAndTheNextDoesNot) {
  Board board = chessboard();
  for (const char* paper : {"A4", "A3", "A2", "A1", "A0"}) {
    board.size_m = largest_size_m(board, paper);
    EXPECT_GT(board.size_m, 0.02) << paper;
    EXPECT_TRUE(draw_target(board, paper)) << paper;
    board.size_m += 1e-3;
    const auto page = draw_target(board, paper);
    ASSERT_FALSE(page) << paper;
    EXPECT_NE(page.error().message.find("would fit"), std::string::npos);
  }
  EXPECT_FALSE(draw_target(chessboard(), "B5"));
}

}  // namespace target_drawing_test
}  // namespace fbvins
