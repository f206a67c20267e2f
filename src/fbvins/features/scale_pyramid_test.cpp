// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/scale_pyramid.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace scale_pyramid_test {

TEST(ScalePyramid, KeepsALinearRampWhereItWas) {
  for (const double factor : {1.05, 1.2, 1.5, 2.0}) {
    Image image(301, 203);
    for (int y = 0; y < 203; ++y)
      for (int x = 0; x < 301; ++x) image.at(x, y) = static_cast<std::uint8_t>(10 + 0.5 * x + 0.3 * y);
    ScalePyramid pyramid;
    pyramid.build(image.view(), 3, factor);
    ASSERT_GE(pyramid.levels(), 2);
    for (int l = 0; l < pyramid.levels(); ++l) {
      const PyramidLevel& level = pyramid.level(l);
      EXPECT_NEAR(level.width * pyramid.scale(l), 301, pyramid.scale(l));
      for (int y = 1; y < level.height - 1; ++y)
        for (int x = 1; x < level.width - 1; ++x) {
          const Vec2 p = pyramid.to_level0(Vec2(x, y), l);
          ASSERT_NEAR(level.row(y)[x], 10 + 0.5 * p.x() + 0.3 * p.y(), 2.0) << factor << ' ' << l << ' ' << x << ' ' << y;
        }
    }
  }
}

TEST(ScalePyramid, BordersRepeatTheEdge) {
  Image image(120, 90);
  for (int y = 0; y < 90; ++y)
    for (int x = 0; x < 120; ++x) image.at(x, y) = static_cast<std::uint8_t>(x + y);
  ScalePyramid pyramid;
  pyramid.build(image.view(), 3, 1.2);
  for (int l = 0; l < pyramid.levels(); ++l) {
    const PyramidLevel& level = pyramid.level(l);
    EXPECT_EQ(level.row(5)[-ScalePyramid::kBorder], level.row(5)[0]);
    EXPECT_EQ(level.row(5)[level.width + 15], level.row(5)[level.width - 1]);
    EXPECT_EQ(level.row(-ScalePyramid::kBorder)[7], level.row(0)[7]);
    EXPECT_EQ(level.row(level.height + 15)[7], level.row(level.height - 1)[7]);
  }
}

TEST(SmoothLevel, KeepsConstantsAndTheSumOfAPoint) {
  Image image(100, 80, 100);
  image.at(50, 40) = 228;
  ScalePyramid pyramid;
  pyramid.build(image.view(), 1, 1.2);
  std::vector<std::uint8_t> out;
  std::vector<std::uint16_t> scratch;
  const PyramidLevel smooth = smooth_level(pyramid.level(0), out, scratch);
  EXPECT_EQ(smooth.row(-8)[-8], 100);
  EXPECT_EQ(smooth.row(87)[107], 100);
  int sum = 0;
  for (int y = 30; y < 50; ++y)
    for (int x = 40; x < 60; ++x) sum += smooth.row(y)[x] - 100;
  EXPECT_NEAR(sum, 128, 20);  // rounding of 49 pixels
  EXPECT_EQ(smooth.row(40)[53], smooth.row(40)[47]);
  EXPECT_EQ(smooth.row(43)[50], smooth.row(37)[50]);
}

TEST(SmoothPatch, HasThePixelsOfTheSmoothedLevel) {
  Image image(90, 80);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) image.at(x, y) = static_cast<std::uint8_t>((x * x + 3 * x * y + 7 * y) % 251);
  ScalePyramid pyramid;
  pyramid.build(image.view(), 1, 1.2);
  std::vector<std::uint8_t> out;
  std::vector<std::uint16_t> scratch;
  const PyramidLevel whole = smooth_level(pyramid.level(0), out, scratch);
  SmoothPatch pixels;
  for (const auto& [x, y] : {std::pair{12, 12}, {77, 67}, {40, 30}}) {  // at the edges, too
    const PyramidLevel patch = smooth_patch(pyramid.level(0), x, y, pixels);
    for (int v = -8; v <= 8; ++v)
      for (int u = -8; u <= 8; ++u)
        ASSERT_EQ(patch.row(kSmoothPatchRadius + v)[kSmoothPatchRadius + u], whole.row(y + v)[x + u]) << x << ' ' << y;
  }
}

}  // namespace scale_pyramid_test
}  // namespace fbvins
