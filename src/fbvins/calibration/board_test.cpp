// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/board.hpp"

#include <gtest/gtest.h>

#include "fbvins/calibration/target_file.hpp"

namespace fbvins {
namespace board_test {

const Board kChessboard{.kind = BoardKind::chessboard, .columns = 7, .rows = 5, .size_m = 0.03, .spacing = 0};
const Board kCharuco{.kind = BoardKind::charuco, .columns = 8, .rows = 6, .size_m = 0.04, .spacing = 0.75};

TEST(Board, CornersOfAnAprilGridCountAroundEachTagAndRowByRow) {
  const Board board{.columns = 6, .rows = 5, .size_m = 0.1, .spacing = 0.3};
  EXPECT_EQ(board.corner_count(), 120);
  EXPECT_LT((board.corner(0) - Vec3(0, 0, 0)).norm(), 1e-15);
  EXPECT_LT((board.corner(1) - Vec3(0.1, 0, 0)).norm(), 1e-15);
  EXPECT_LT((board.corner(2) - Vec3(0.1, 0.1, 0)).norm(), 1e-15);
  EXPECT_LT((board.corner(3) - Vec3(0, 0.1, 0)).norm(), 1e-15);
  EXPECT_LT((board.corner(4 * 7) - Vec3(0.13, 0.13, 0)).norm(), 1e-15);
  EXPECT_LT((board.corner(119) - Vec3(5 * 0.13, 4 * 0.13 + 0.1, 0)).norm(), 1e-15);
}

TEST(Board, InnerCornersCountRowByRow) {
  EXPECT_EQ(kChessboard.corner_count(), 35);
  EXPECT_LT((kChessboard.corner(8) - Vec3(0.03, 0.03, 0)).norm(), 1e-15);
  EXPECT_EQ(kCharuco.corner_count(), 35);
  EXPECT_LT((kCharuco.corner(8) - Vec3(0.04, 0.04, 0)).norm(), 1e-15);
}

TEST(TargetFile, WhatIsWrittenIsReadBack) {
  for (const Board& board : {Board{}, kChessboard, kCharuco}) {
    const Result<Board> read = parse_target(target_to_yaml(board), "target.yaml");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(*read, board);
    EXPECT_EQ(impossible(board), "");
  }
}

TEST(TargetFile, ReadsKalibrsExample) {
  const auto board = parse_target(
      "target_type: 'aprilgrid' #gridtype\ntagCols: 6               #number of apriltags\ntagRows: 5\n"
      "tagSize: 0.088           #size of apriltag, edge to edge [m]\ntagSpacing: 0.3\ncodeOffset: 0\n",
      "april.yaml");
  ASSERT_TRUE(board) << board.error().message;
  EXPECT_EQ(*board, (Board{.columns = 6, .rows = 5, .size_m = 0.088, .spacing = 0.3}));
}

/// The complaint about an AprilGrid with a line in place of another.
std::string complaint(const std::string& without, const std::string& with) {
  std::string text = "target_type: aprilgrid\ntagCols: 6\ntagRows: 6\ntagSize: 0.088\ntagSpacing: 0.3\n";
  text.replace(text.find(without), without.size(), with);
  const auto board = parse_target(text, "a.yaml");
  return board ? "read" : board.error().message;
}

TEST(TargetFile, ComplaintsNameFileAndField) {
  EXPECT_NE(complaint("tagSize: 0.088", "tagSize: 88").find("a.yaml:4: tagSize: 88 m is not between"), std::string::npos);
  EXPECT_NE(complaint("tagSize: 0.088", "").find("tagSize"), std::string::npos);
  EXPECT_NE(complaint("tagCols: 6", "tagCols: 6.5").find("a.yaml:2: tagCols: 6.5 is not a whole number"), std::string::npos);
  EXPECT_NE(complaint("tagCols: 6", "tagCols: 0").find("tagCols"), std::string::npos);
  EXPECT_NE(complaint("tagCols: 6", "tagCols: 99").find("more than the 587"), std::string::npos);
  EXPECT_NE(complaint("tagSpacing: 0.3", "tagSpacing: 26").find("as a part of tagSize"), std::string::npos);
  EXPECT_NE(complaint("aprilgrid", "circlegrid").find("'circlegrid' is none of"), std::string::npos);
  EXPECT_NE(complaint("tagRows: 6", "tagRows: 6\ntagColor: red").find("tagColor"), std::string::npos);
  EXPECT_FALSE(parse_target("", "a.yaml"));
  EXPECT_FALSE(load_target("there/is/none.yaml"));
}

}  // namespace board_test
}  // namespace fbvins
