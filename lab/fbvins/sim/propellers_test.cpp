// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/propellers.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace fbvins {
namespace propellers_test {

constexpr int kWidth = 376, kHeight = 240;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;

std::vector<float> rendered(double t_s, double exposure_s, double line_delay_s = 0) {
  std::vector<float> radiance(kPixels, 0.4f);
  Propellers(kWidth, kHeight, 2, 0).draw(radiance, t_s, exposure_s, line_delay_s);
  return radiance;
}

int darkened(const std::vector<float>& radiance) {
  return static_cast<int>(std::count_if(radiance.begin(), radiance.end(), [](float value) { return value < 0.39f; }));
}

TEST(Propellers, AreInTheUpperCornersAlone) {
  const Image reach = Propellers(kWidth, kHeight, 2, 0).reach();
  const std::vector<float> radiance = rendered(1.23, 0.02);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (reach.at(x, y) != 0) {
        EXPECT_EQ(radiance[static_cast<std::size_t>(y * kWidth + x)], 0.4f);
      }
  EXPECT_EQ(reach.at(20, 20), 0);
  EXPECT_EQ(reach.at(kWidth - 20, 20), 0);
  EXPECT_EQ(reach.at(kWidth / 2, kHeight / 2), 255);
  EXPECT_EQ(reach.at(20, kHeight - 20), 255);
}

TEST(Propellers, BladesTurnBetweenImages) {
  const std::vector<float> one = rendered(1, 1e-4);
  ASSERT_GT(darkened(one), 0);
  int seen = 0, alike = 0;
  for (int image = 1; image <= 20; ++image) {
    const std::vector<float> other = rendered(1 + 0.05 * image, 1e-4);
    int both = 0;
    for (std::size_t i = 0; i < kPixels; ++i) both += one[i] < 0.1f && other[i] < 0.1f;
    seen += darkened(other) > 0;
    alike += 2 * both > darkened(one);
  }
  EXPECT_GT(seen, 8) << "of 20; a blade is often out of view";
  EXPECT_LT(alike, 5);
}

TEST(Propellers, AnExposureOfHalfATurnBlursThemOverAllTheirReach) {
  const Image reach = Propellers(kWidth, kHeight, 2, 0).reach();
  const std::vector<float> sharp = rendered(1, 1e-5), blurred = rendered(1, 0.02);
  EXPECT_LT(4 * darkened(sharp), darkened(blurred));
  EXPECT_LT(*std::min_element(sharp.begin(), sharp.end()), 0.05f) << "black";
  EXPECT_GT(*std::min_element(blurred.begin(), blurred.end()), 0.05f) << "a shade";
}

TEST(Propellers, ARollingShutterBendsThem) { EXPECT_NE(rendered(1, 1e-4, 4e-5), rendered(1, 1e-4)); }

}  // namespace propellers_test
}  // namespace fbvins
