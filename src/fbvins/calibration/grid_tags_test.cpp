// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/grid_tags.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "fbvins/camera/camera.hpp"

namespace fbvins {
namespace grid_tags_test {

const Board kBoard{.columns = 4, .rows = 3, .size_m = 0.088, .spacing = 0.3};

/// What would be read of the board, seen from the side by a lens of wide angle.
std::vector<TagDetection> read_of(const Board& board, int border) {
  const Camera camera(KannalaBrandt{190.98, 190.97, 254.93, 256.90, 0.0034, 0.0007, -0.0020, 0.0002}, 512, 512);
  const Quat tilted = Quat(0, 1, 0, 0) * so3_exp(Vec3(0.2, 0.8, 0.4));
  std::vector<TagDetection> out;
  for (int id = 0; id < board.columns * board.rows; ++id) {
    TagDetection tag{id, border, 0, {}};
    for (int k = 0; k < 4; ++k) tag.corners[k] = *camera.project(tilted * board.corner(4 * id + k) + Vec3(-0.15, 0.15, 0.35));
    out.push_back(tag);
  }
  return out;
}

std::vector<int> ids(const GridTags& seen) {
  std::vector<int> out;
  for (const TagDetection& tag : seen.tags) out.push_back(tag.id);
  return out;
}

TEST(GridTags, AWholeBoardAgrees) {
  for (const int border : {kLibraryBorder, kKalibrBorder}) {
    const GridTags seen = tags_of_grid(kBoard, read_of(kBoard, border));
    EXPECT_EQ(seen.tags.size(), 12u);
    EXPECT_EQ(seen.tags[0].border, border);
  }
}

TEST(GridTags, NumbersThatWereReadByLuckAreLeftOut) {
  std::vector<TagDetection> found = read_of(kBoard, kKalibrBorder);
  found[3].id = 7;                                                                                     // and 7 is there, too
  std::ranges::rotate(found[5].corners, found[5].corners.begin() + 1);                                 // turned
  for (Vec2& corner : found[10].corners) corner += 1.6 * (found[1].corners[0] - found[0].corners[0]);  // elsewhere
  std::vector<TagDetection> by_luck{found[2], found[6], found[8]};  // with the other border, right and wrong
  for (TagDetection& tag : by_luck) tag.border = kLibraryBorder, tag.wrong_cells = 1;
  by_luck[2].id = 9;
  found.insert(found.end(), by_luck.begin(), by_luck.end());
  std::ranges::stable_sort(found, {}, &TagDetection::id);
  const GridTags seen = tags_of_grid(kBoard, found);
  EXPECT_EQ(ids(seen), (std::vector<int>{0, 1, 2, 4, 6, 7, 8, 9, 11}));
  EXPECT_EQ(seen.twice, 0);
  EXPECT_EQ(seen.foreign, 0);
  for (const TagDetection& tag : seen.tags) EXPECT_EQ(tag.border, kKalibrBorder);
}

TEST(GridTags, OneTagAloneCountsOnlyOnABoardOfOne) {
  std::vector<TagDetection> one{read_of(kBoard, kKalibrBorder)[0]};
  EXPECT_TRUE(tags_of_grid(kBoard, one).tags.empty());
  EXPECT_EQ(tags_of_grid({.columns = 1, .rows = 1}, one).tags.size(), 1u);
  one[0].wrong_cells = 1;
  EXPECT_TRUE(tags_of_grid({.columns = 1, .rows = 1}, one).tags.empty());
}

TEST(GridTags, ATargetFileOfAnotherBoardHidesNothing) {
  const std::vector<TagDetection> found = read_of(kBoard, kKalibrBorder);
  Board other = kBoard;
  std::swap(other.columns, other.rows);
  EXPECT_EQ(tags_of_grid(other, found).tags.size(), 12u);
  other = kBoard;
  other.spacing = 1.2;
  EXPECT_EQ(tags_of_grid(other, found).tags.size(), 12u);
  other = kBoard;
  other.rows = 1;
  EXPECT_EQ(tags_of_grid(other, found).foreign, 8);
}

}  // namespace grid_tags_test
}  // namespace fbvins
