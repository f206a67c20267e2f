// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/depth_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace depth_model_test {

constexpr int kWidth = 320, kHeight = 240;
const Camera kCamera(PinholeRadtan{.fx = 200, .fy = 200, .cx = 160, .cy = 120}, kWidth, kHeight);

std::vector<float> flat(float depth_m) { return std::vector<float>(kWidth * kHeight, depth_m); }

/// A box of 1 m distance in the middle, 3 m elsewhere.
std::vector<float> box() {
  std::vector<float> depth = flat(3);
  for (int y = 80; y < 160; ++y)
    for (int x = 120; x < 200; ++x) depth[static_cast<std::size_t>(y * kWidth + x)] = 1;
  return depth;
}

double sigma_m(double depth_m) {
  const DepthImage image = DepthModel({.hole_share = 0}, kCamera, 5).measure(flat(static_cast<float>(depth_m)), 2);
  double squares = 0;
  for (const std::uint16_t mm : image.mm) squares += std::pow(1e-3 * mm - depth_m, 2);
  return std::sqrt(squares / static_cast<double>(image.mm.size()));
}

TEST(DepthModel, NoiseGrowsWithTheSquareOfTheDistance) {
  EXPECT_NEAR(sigma_m(1), 0.003, 0.0003);
  EXPECT_NEAR(sigma_m(3), 0.027, 0.003);
}

TEST(DepthModel, TheSameFrameGivesTheSameDepths) {
  const DepthModel model({}, kCamera, 5);
  EXPECT_EQ(model.measure(box(), 7).mm, model.measure(box(), 7).mm);
  EXPECT_NE(model.measure(box(), 7).mm, model.measure(box(), 8).mm);
}

TEST(DepthModel, HasHolesAndARange) {
  const DepthImage holes = DepthModel({.hole_share = 0.1}, kCamera, 5).measure(flat(2), 1);
  const auto zeros = std::ranges::count(holes.mm, 0);
  EXPECT_NEAR(static_cast<double>(zeros) / static_cast<double>(holes.mm.size()), 0.1, 0.02);
  for (const float outside_m : {0.1F, 9.0F}) {
    const DepthImage none = DepthModel({}, kCamera, 5).measure(flat(outside_m), 1);
    EXPECT_EQ(std::ranges::count(none.mm, 0), std::ssize(none.mm));
  }
}

TEST(DepthModel, NearThingsAreTooWideAndCastAShadow) {
  const DepthImage image = DepthModel({.noise_at_1m_m = 1e-5, .hole_share = 0}, kCamera, 5).measure(box(), 1);
  int wide = 0, shadow = 0;
  for (int y = 82; y < 158; ++y) {
    for (int x = 200; x < 203; ++x) wide += image.row(y)[x] > 0 && image.row(y)[x] < 1100;
    for (int x = 105; x < 120; ++x) shadow += image.row(y)[x] == 0;  // of the second eye, to the left of the box
    EXPECT_GT(image.row(y)[215], 2900);
  }
  EXPECT_GT(wide, 20);
  EXPECT_GT(shadow, 76 * 4);
}

}  // namespace depth_model_test
}  // namespace fbvins
