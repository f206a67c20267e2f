// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/tag_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "fbvins/calibration/board_detector.hpp"
#include "fbvins/calibration/board_image.hpp"
#include "fbvins/calibration/simulated_board.hpp"

#ifdef FBVINS_WITH_APRILTAG

namespace fbvins {
namespace tag_search_test {

const Board kBoard{.columns = 6, .rows = 6, .size_m = 0.088, .spacing = 0.3};
const Camera& camera() {
  static const Camera out = example_cameras()[0];
  return out;
}

/// Its four corners lie in the image, and its edges have as many pixels.
bool visible(const Pose<Cn, T>& T_CnT, int id, double least_px) {
  Quad quad;
  for (int k = 0; k < 4; ++k) {
    const auto p = camera().project(T_CnT * kBoard.corner(4 * id + k));
    if (!p || !camera().inside(*p, 8)) return false;
    quad[static_cast<std::size_t>(k)] = *p;
  }
  for (std::size_t k = 0; k < 4; ++k)
    if ((quad[k] - quad[(k + 1) % 4]).norm() < least_px) return false;
  return true;
}

Pose<Cn, T> random_pose(Rng& rng) {
  const auto pose = random_board_pose({{camera()}, {{}}}, 0, kBoard, rng);
  return {pose.q, pose.p};
}

TEST(TagSearch, SharpTagsOfEitherBorderAreAlmostAllFound) {
  for (const int border : {kLibraryBorder, kKalibrBorder}) {
    Rng rng(11);
    const BoardCamera renderer(camera(), *BoardPattern::create(kBoard, border));
    BoardDetector detector = *BoardDetector::create(kBoard);
    int seen = 0, expected = 0;
    for (int i = 0; i < 4; ++i) {
      const Pose<Cn, T> T_CnT = random_pose(rng);
      const BoardDetection found = detector.find(renderer.render({T_CnT}, {}, rng).view());
      for (int id = 0; id < 36; ++id) {
        if (!visible(T_CnT, id, 16)) continue;
        ++expected;
        seen += std::ranges::count_if(found.corners, [&](const BoardCorner& corner) { return corner.index / 4 == id; }) >= 3;
      }
      for (const BoardCorner& corner : found.corners)
        EXPECT_LT((corner.pixel - *camera().project(T_CnT * kBoard.corner(corner.index))).norm(), 0.3) << corner.index;
    }
    EXPECT_GT(expected, 60);
    EXPECT_GE(seen, 0.97 * expected) << border;
  }
}

TEST(TagSearch, CellsAreReadFromTheImageItself) {
  Rng rng(2);
  const TagReader reader = *TagReader::create(kBoard.spacing);
  for (const int border : {kLibraryBorder, kKalibrBorder}) {
    const Pose<Cn, T> T_CnT(Quat(0, 1, 0, 0) * so3_exp(Vec3(0.2, 0.3, 0.5)), Vec3(-0.3, 0.25, 1.1));
    const Image image = BoardCamera(camera(), *BoardPattern::create(kBoard, border)).render({T_CnT}, {}, rng);
    for (const int id : {0, 14, 21}) {
      ASSERT_TRUE(visible(T_CnT, id, 16)) << id;
      Quad quad;
      for (int k = 0; k < 4; ++k) quad[static_cast<std::size_t>(k)] = *camera().project(T_CnT * kBoard.corner(4 * id + k));
      const Quad upright = quad;
      for (std::size_t turn = 0; turn < 4; ++turn) {
        const auto tag = reader.read(image.view(), quad);
        ASSERT_TRUE(tag) << id << ", border " << border;
        EXPECT_EQ(tag->id, id);
        EXPECT_EQ(tag->border, border);
        EXPECT_EQ(tag->wrong_cells, 0);
        EXPECT_LT((tag->corners[0] - upright[0]).norm(), 1e-9);
        std::ranges::rotate(quad, quad.begin() + 1);
      }
      EXPECT_EQ(reader.wrong_cells(image.view(), upright, id, border), 0);
      EXPECT_GE(reader.wrong_cells(image.view(), upright, id + 1, border), 10);
      std::ranges::reverse(quad);  // mirrored
      EXPECT_FALSE(reader.read(image.view(), quad));
    }
  }
}

/// Noise, black, and dark squares without a pattern are no tags.
TEST(TagSearch, NothingIsReadWhereThereIsNoTag) {
  const TagReader reader = *TagReader::create(kBoard.spacing);
  Rng rng(7);
  Image noise(320, 240), squares(320, 240, 210);
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) {
      noise.at(x, y) = static_cast<std::uint8_t>(rng.uniform(0, 255));
      if (x % 60 > 20 && y % 60 > 20) squares.at(x, y) = 20;
    }
  EXPECT_TRUE(search_tags(noise.view(), reader, 36).empty());
  EXPECT_TRUE(search_tags(squares.view(), reader, 36).empty());
  EXPECT_TRUE(search_tags(Image(320, 240, 20).view(), reader, 36).empty());
  EXPECT_TRUE(search_tags(Image(3, 2, 20).view(), reader, 36).empty());
  EXPECT_TRUE(search_tags(ImageView{}, reader, 36).empty());
  EXPECT_EQ(dark_squares(squares.view(), {}).size(), 15u);  // what reaches the border is left out
}

}  // namespace tag_search_test
}  // namespace fbvins

#endif
