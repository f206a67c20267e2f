// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/board_detector.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/calibration/board_image.hpp"
#include "fbvins/calibration/corner_refine.hpp"
#include "fbvins/calibration/simulated_board.hpp"
#include "fbvins/calibration/target_drawing.hpp"

namespace fbvins {
namespace board_detector_test {

const Board kBoard{.columns = 4, .rows = 3, .size_m = 0.088, .spacing = 0.3};

#ifdef FBVINS_WITH_APRILTAG

struct Found {
  double rms_px = 0, bias_px = 0;
  int corners = 0, visible = 0;  ///< visible: of tags that lie in the image and are large enough
};

/// Renders the board at random poses and compares what is found with the exact projection.
Found compare(const Camera& camera, int border, const BoardImageOptions& options, std::uint64_t seed) {
  Found out;
  Rng rng(seed);
  const SimulatedRig rig{{camera}, {{}}};
  const BoardCamera renderer(camera, *BoardPattern::create(kBoard, border));
  BoardDetector detector = *BoardDetector::create(kBoard);
  Vec2 sum = Vec2::Zero();
  for (int i = 0; i < 2; ++i) {
    const Pose<C0, T> T_C0T = random_board_pose(rig, 0, kBoard, rng, 0.7);
    const Pose<Cn, T> T_CnT(T_C0T.q, T_C0T.p);
    const Image image = renderer.render({T_CnT}, options, rng);
    for (int first = 0; first < kBoard.corner_count(); first += 4) {
      double side_px = 1e9;
      for (int k = 0; k < 4; ++k) {
        const auto p = camera.project(T_CnT * kBoard.corner(first + k)),
                   q = camera.project(T_CnT * kBoard.corner(first + (k + 1) % 4));
        side_px = p && q && camera.inside(*p, 8) ? std::min(side_px, (*p - *q).norm()) : 0;
      }
      out.visible += side_px > 18 ? 4 : 0;
    }
    for (const BoardCorner& corner : detector.find(image.view()).corners) {
      const Vec2 error = corner.pixel - *camera.project(T_CnT * kBoard.corner(corner.index));
      out.rms_px += 0.5 * error.squaredNorm();
      sum += error;
      ++out.corners;
    }
  }
  out.rms_px = std::sqrt(out.rms_px / std::max(1, out.corners));
  out.bias_px = sum.norm() / std::max(1, out.corners);
  return out;
}

TEST(BoardDetector, CornersAreFoundToASmallPartOfAPixel) {
  for (const int border : {kLibraryBorder, kKalibrBorder})
    for (const std::size_t kind : {0u, 1u}) {
      const Found found = compare(example_cameras()[kind], border, {}, 5 + kind);
      EXPECT_GT(found.corners, (kind == 1 ? 0.7 : 0.95) * found.visible) << kind << ", border " << border;
      EXPECT_LT(found.rms_px, 0.04) << kind << ", border " << border;
      EXPECT_LT(found.bias_px, 0.02) << kind << ", border " << border;
    }
}

class PrintedBoard : public ::testing::TestWithParam<int> {};

TEST_P(PrintedBoard, IsWhatIsFound) {
  const auto page = draw_target(kBoard, "A0", GetParam());
  ASSERT_TRUE(page) << page.error().message;
  constexpr double kPixels = 1;  // a millimetre
  Image image(static_cast<int>(page->width_mm * kPixels), static_cast<int>(page->height_mm * kPixels), 255);
  for (const DrawnRectangle& r : page->rectangles)
    for (int y = static_cast<int>(std::ceil(r.y - 0.5)); y < r.y + r.height - 0.5; ++y)
      for (int x = static_cast<int>(std::ceil(r.x - 0.5)); x < r.x + r.width - 0.5; ++x)
        if (x >= 0 && y >= 0 && x < image.width() && y < image.height()) image.at(x, y) = r.black ? 0 : 255;
  BoardDetector detector = *BoardDetector::create(kBoard);
  const BoardDetection seen = detector.find(image.view());
  EXPECT_EQ(seen.tags, 12);
  EXPECT_EQ(seen.corners.size(), 48u);
  for (const BoardCorner& corner : seen.corners) {
    const Vec3 p_T = 1e3 * kBoard.corner(corner.index);
    const Vec2 expected = page->origin_mm + Vec2(p_T.x(), -p_T.y()) - Vec2(0.5, 0.5);  // y is upwards on the board
    EXPECT_LT((corner.pixel - expected).norm(), 0.71) << corner.index;                 // edges are rendered on whole pixels
  }
  EXPECT_FALSE(detector.finds_mirrored(image.view()));
  Image mirrored(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) mirrored.at(x, y) = image.at(image.width() - 1 - x, y);
  EXPECT_EQ(detector.find(mirrored.view()).tags, 0);
  EXPECT_TRUE(detector.finds_mirrored(mirrored.view()));
}

INSTANTIATE_TEST_SUITE_P(OfBothBorders, PrintedBoard, ::testing::Values(kLibraryBorder, kKalibrBorder));

TEST(BoardDetector, ATagThatIsNotThereIsNotFilledIn) {
  for (const int border : {kLibraryBorder, kKalibrBorder}) {
    BoardPattern pattern = *BoardPattern::create(kBoard, border);
    pattern.leave_out(5);
    Rng rng(3);
    const Pose<Cn, T> T_CnT(Quat(0, 1, 0, 0) * so3_exp(Vec3(0.3, 0.4, 0.1)), Vec3(-0.2, 0.15, 0.7));
    const Image image = BoardCamera(example_cameras()[0], pattern).render({T_CnT}, {}, rng);
    const BoardDetection seen = BoardDetector::create(kBoard)->find(image.view());
    EXPECT_EQ(seen.tags, 11) << border;
    for (const BoardCorner& corner : seen.corners) EXPECT_NE(corner.index / 4, 5) << border;
  }
}

/// Kalibr's tags with cells of two pixels, which are seldom read by themselves.
TEST(BoardDetector, SmallTagsAreFoundBesideOthers) {
  const Camera camera(KannalaBrandt{190.98, 190.97, 254.93, 256.90, 0.0034, 0.0007, -0.0020, 0.0002}, 512, 512);
  const Board board{.columns = 6, .rows = 6, .size_m = 0.088, .spacing = 0.3};
  Rng rng(4);
  const Pose<Cn, T> T_CnT(Quat(0, 1, 0, 0) * so3_exp(Vec3(0.1, 0.2, 0.1)), Vec3(-0.3, 0.3, 0.75));
  const Image image = BoardCamera(camera, *BoardPattern::create(board, kKalibrBorder)).render({T_CnT}, {}, rng);
  const BoardDetection seen = BoardDetector::create(board)->find(image.view());
  EXPECT_GT(seen.tags, 30);
  for (const BoardCorner& corner : seen.corners)
    EXPECT_LT((corner.pixel - *camera.project(T_CnT * board.corner(corner.index))).norm(), 0.3) << corner.index;
}

TEST(BoardDetector, TagsOfOtherBoardsAndDoubleTagsAreCounted) {
  const SimulatedRig rig{{example_cameras()[0]}, {{}}};
  Rng rng(3);
  const BoardCamera renderer(rig.cameras[0], *BoardPattern::create(kBoard));
  const Pose<Cn, T> T_CnT(Quat(0, 1, 0, 0), Vec3(-0.2, 0.15, 0.7));
  const Image image = renderer.render({T_CnT}, {}, rng);
  Board smaller = kBoard;
  smaller.rows = 2;
  EXPECT_EQ(BoardDetector::create(smaller)->find(image.view()).foreign_tags, 4);
  Image twice(2 * image.width(), image.height());
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < twice.width(); ++x) twice.at(x, y) = image.at(x % image.width(), y);
  const BoardDetection seen = BoardDetector::create(kBoard)->find(twice.view());
  EXPECT_GE(seen.twice, 10);
  EXPECT_TRUE(seen.corners.empty());
}

#endif

TEST(BoardDetector, OtherKindsOfBoardsAreRefused) {
  const auto detector =
      BoardDetector::create({.kind = BoardKind::chessboard, .columns = 7, .rows = 5, .size_m = 0.03, .spacing = 0});
  ASSERT_FALSE(detector);
  EXPECT_NE(detector.error().message.find("--detections"), std::string::npos);
}

TEST(CornerRefine, ASaddleIsFoundAndAnEdgeIsNot) {
  const auto draw = [](auto&& black) {
    Image image(40, 40);
    for (int y = 0; y < 40; ++y)
      for (int x = 0; x < 40; ++x) {
        int dark = 0;
        for (int s = 0; s < 64; ++s) dark += black(x - 0.5 + (s % 8 + 0.5) / 8, y - 0.5 + (s / 8 + 0.5) / 8);
        image.at(x, y) = static_cast<std::uint8_t>(220 - 3 * dark);
      }
    return image;
  };
  const Vec2 at(19.3, 20.6), kAcross(10, 1), kDown(0, 12);
  const Image saddle =
      draw([&](double x, double y) { return (x < at.x() + 0.2 * (y - at.y())) == (y < at.y() - 0.1 * (x - at.x())); });
  const auto found = refine_corner(saddle.view(), at + Vec2(0.9, -0.7), kAcross, kDown, 4);
  ASSERT_TRUE(found);
  EXPECT_LT((*found - at).norm(), 0.02);
  const Image edge = draw([&](double x, double) { return x < 19.3; });
  EXPECT_FALSE(refine_corner(edge.view(), at, kAcross, kDown, 4));
  EXPECT_FALSE(refine_corner(Image(40, 40, 100).view(), at, kAcross, kDown, 4));
  EXPECT_FALSE(refine_corner(saddle.view(), {2, 2}, kAcross, kDown, 4));
}

}  // namespace board_detector_test
}  // namespace fbvins
