// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/depth_reader.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace depth_reader_test {

constexpr int kWidth = 64, kHeight = 48;
constexpr double kNoise_m = 0.003;

const Camera& camera() {
  static const Camera camera(PinholeRadtan{.fx = 60, .fy = 60, .cx = 32, .cy = 24}, kWidth, kHeight);
  return camera;
}

/// `depth_m` of a pixel, rounded as a sensor does.
DepthImage image_of(const std::function<double(double x, double y)>& depth_m) {
  DepthImage image{kWidth, kHeight, {}};
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) image.mm.push_back(static_cast<std::uint16_t>(std::lround(1000 * depth_m(x, y))));
  return image;
}

const DepthReader& reader() {
  static const DepthReader reader({.noise_at_1m_m = kNoise_m, .nearest_m = 0.3, .farthest_m = 6}, camera());
  return reader;
}

/// A wall that is turned by 60 degrees.
double wall(double x, double) { return 2 / (1 + 1.7 * (x - 32) / 60); }

TEST(DepthReader, OnATiltedPlaneTheDepthIsThatOfThePixelBetweenTheSamples) {
  const DepthImage image = image_of(wall);
  for (const Vec2& px : {Vec2(31.4, 20.2), Vec2(40.7, 30.5)}) {
    const auto depth = reader().at(image, px);
    ASSERT_TRUE(depth);
    EXPECT_NEAR(1 / depth->value, wall(px.x(), px.y()), 0.001);
    EXPECT_NEAR(depth->sigma, kNoise_m, 0.001);
  }
}

TEST(DepthReader, TheErrorIsWithinItsSigma) {
  Rng rng(3, 1);
  const DepthImage image = image_of([&](double, double) { return 1 / (1 / 2.5 + kNoise_m * rng.normal()); });
  int count = 0, within = 0;
  for (int y = 3; y < kHeight - 3; ++y)
    for (int x = 3; x < kWidth - 3; ++x)
      if (const auto depth = reader().at(image, Vec2(x, y))) ++count, within += std::abs(depth->value - 0.4) < depth->sigma;
  EXPECT_GT(count, 2000);
  EXPECT_GT(within, 0.95 * count);
}

TEST(DepthReader, SaysNothingAtAnEdgeOfDepth) {
  const DepthImage image = image_of([](double x, double) { return x < 32 ? 1.5 : 2.5; });
  EXPECT_TRUE(reader().at(image, Vec2(20, 20)));
  for (const double x : {30.0, 31.0, 32.0, 33.0}) EXPECT_FALSE(reader().at(image, Vec2(x, 20))) << x;
  EXPECT_TRUE(reader().at(image, Vec2(44, 20)));
}

TEST(DepthReader, SaysNothingInHolesOutOfRangeAndAtTheBorder) {
  const DepthImage image = image_of([](double x, double y) { return y < 16 ? 0 : y < 32 ? (x < 32 ? 0.2 : 7.0) : 3.0; });
  EXPECT_FALSE(reader().at(image, Vec2(20, 8)));
  EXPECT_FALSE(reader().at(image, Vec2(16, 24)));
  EXPECT_FALSE(reader().at(image, Vec2(48, 24)));
  EXPECT_TRUE(reader().at(image, Vec2(48, 40)));
  for (const Vec2& px : {Vec2(1, 40), Vec2(62, 40), Vec2(48, 46), Vec2(-5, 40), Vec2(48, 1000)})
    EXPECT_FALSE(reader().at(image, px));
}

TEST(DepthReader, TakesImagesOfTheCamerasSizeOnly) {
  const DepthImage good = image_of(wall);
  EXPECT_TRUE(reader().is_usable(&good));
  EXPECT_FALSE(reader().is_usable(nullptr));
  DepthImage smaller = good;
  smaller.width -= 1;
  EXPECT_FALSE(reader().is_usable(&smaller));
  DepthImage cut = good;
  cut.mm.pop_back();
  EXPECT_FALSE(reader().is_usable(&cut));
}

}  // namespace depth_reader_test
}  // namespace fbvins
