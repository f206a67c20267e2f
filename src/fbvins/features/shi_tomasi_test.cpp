// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/shi_tomasi.hpp"

#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "tests/support/noise_texture.hpp"

namespace fbvins {
namespace shi_tomasi_test {

constexpr double kMinDistance_px = 22;
constexpr auto kIdentity = [](const Vec2& p) { return p; };

template <class Detector>
concept Detects = requires(Detector&& detector, const Pyramid& pyramid) {
  std::forward<Detector>(detector).detect(pyramid, {}, 1);
};
static_assert(Detects<ShiTomasiDetector&> && !Detects<ShiTomasiDetector>,
              "the corners are the detector's, which has to live longer");

TEST(ShiTomasi, FillsTheImageAndKeepsCornersApart) {
  const Image image = render_texture(376, 240, NoiseTexture(5), kIdentity, 120, 35);
  Pyramid pyramid;
  pyramid.build(image.view(), 1);
  ShiTomasiDetector detector(kMinDistance_px);
  const std::vector<Corner> corners = detector.detect(pyramid, {}, 60);
  EXPECT_EQ(corners.size(), 60u);
  std::set<std::pair<int, int>> cells;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    cells.insert(
        {static_cast<int>(corners[i].px.x()) / detector.cell_px(), static_cast<int>(corners[i].px.y()) / detector.cell_px()});
    for (std::size_t j = 0; j < i; ++j) EXPECT_GE((corners[i].px - corners[j].px).norm(), 0.6 * kMinDistance_px);
  }
  EXPECT_GE(cells.size(), 40u);  // of 54
}

TEST(ShiTomasi, LeavesCellsAloneThatHaveFeatures) {
  const Image image = render_texture(376, 240, NoiseTexture(5), kIdentity, 120, 35);
  Pyramid pyramid;
  pyramid.build(image.view(), 1);
  ShiTomasiDetector detector(kMinDistance_px);
  const std::vector<Corner> first = detector.detect(pyramid, {}, 30);
  std::vector<Vec2> existing;
  for (const Corner& corner : first) existing.push_back(corner.px);
  const std::vector<Corner> second = detector.detect(pyramid, existing, 30);
  EXPECT_GT(second.size(), 5u);
  for (const Corner& corner : second)
    for (const Vec2& px : existing) EXPECT_GE((corner.px - px).norm(), 0.6 * kMinDistance_px);
  EXPECT_TRUE(detector.detect(pyramid, existing, 0).empty());
}

TEST(ShiTomasi, FindsTheCornerOfASquare) {
  Image image(120, 120, 40);
  for (int y = 60; y < 120; ++y)
    for (int x = 60; x < 120; ++x) image.at(x, y) = 200;
  Pyramid pyramid;
  pyramid.build(image.view(), 1);
  ShiTomasiDetector detector(kMinDistance_px);
  const std::vector<Corner> corners = detector.detect(pyramid, {}, 1);
  ASSERT_EQ(corners.size(), 1u);
  // The edge runs between 59 and 60; the window of 7 px has most of both edges in it 2 px inside of the corner.
  EXPECT_NEAR(corners[0].px.x(), 61.73, 0.05);
  EXPECT_NEAR(corners[0].px.x(), corners[0].px.y(), 0.01);
}

TEST(ShiTomasi, DimTextureDeliversAndPureNoiseDoesNot) {
  Pyramid pyramid;
  ShiTomasiDetector detector(kMinDistance_px);
  pyramid.build(render_texture(376, 240, NoiseTexture(6), kIdentity, 12, 6, 0.7).view(), 1);
  EXPECT_GE(detector.detect(pyramid, {}, 60).size(), 40u);
  pyramid.build(render_texture(376, 240, NoiseTexture(6), kIdentity, 100, 0, 3.0).view(), 1);
  EXPECT_LE(detector.detect(pyramid, {}, 60).size(), 3u);
  EXPECT_NEAR(detector.noise(), 3.0, 0.3);
  pyramid.build(Image(376, 240, 0).view(), 1);
  EXPECT_TRUE(detector.detect(pyramid, {}, 60).empty());
}

/// A bright square of this side and grey value.
void paint_square(Image& image, int x0, int y0, int side, std::uint8_t grey) {
  for (int y = y0; y < y0 + side; ++y)
    for (int x = x0; x < x0 + side; ++x) image.at(x, y) = grey;
}

TEST(ShiTomasi, WhatIsHiddenTakesNoPlaceInItsCell) {
  Image image(176, 132, 60), seen(176, 132, 255);
  paint_square(image, 48, 48, 8, 250);  // a stronger one, in the same cell of 44 px
  paint_square(image, 76, 76, 8, 90);
  Pyramid pyramid;
  pyramid.build(image.view(), 1);
  ShiTomasiDetector detector(kMinDistance_px);
  ASSERT_FALSE(detector.detect(pyramid, {}, 1).empty());
  EXPECT_LT((detector.detect(pyramid, {}, 1).front().px - Vec2(52, 52)).norm(), 8);
  hide(seen, MaskRectangle{44, 44, 16, 16});
  const Mask mask(seen);
  const std::vector<Corner> corners = detector.detect(pyramid, {}, 10, &mask);
  ASSERT_FALSE(corners.empty());
  for (const Corner& corner : corners) EXPECT_LT((corner.px - Vec2(80, 80)).norm(), 8);
}

TEST(ShiTomasi, KeepsItsDistanceFromWhatIsHiddenAndFillsTheRest) {
  const Image image = render_texture(376, 240, NoiseTexture(5), kIdentity, 120, 35);
  Image seen(376, 240, 255);
  hide(seen, MaskRectangle{0, 140, 376, 100});
  hide(seen, MaskCircle{100, 60, 30});
  const Mask mask(seen);
  Pyramid pyramid;
  pyramid.build(image.view(), 1);
  ShiTomasiDetector detector(kMinDistance_px);
  const std::vector<Corner> corners = detector.detect(pyramid, {}, 40, &mask);
  EXPECT_GE(corners.size(), 25u);
  for (const Corner& corner : corners) EXPECT_FALSE(mask.hides(corner.px, kMaskMargin_px - 1));
}

}  // namespace shi_tomasi_test
}  // namespace fbvins
