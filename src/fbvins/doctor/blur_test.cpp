// SPDX-License-Identifier: Apache-2.0
// The exposure of images with motion blur from the camera's rotation.
#include "fbvins/doctor/blur.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace blur_test {

constexpr int kWidth = 320, kHeight = 240, kImages = 80;
constexpr double kFocal_px = 500, kRate_radps = 1.4;
constexpr Duration kImage{50'000'000};

/// Discs over discs, `stretch` times as wide as high, a little out of focus.
Image discs(double stretch) {
  Rng rng(2);
  Image sharp(2 * kWidth, 2 * kHeight, 100);
  for (int i = 0; i < 900; ++i) {
    const int x0 = static_cast<int>(rng.below(2 * kWidth)), y0 = static_cast<int>(rng.below(2 * kHeight));
    const int high = 6 + static_cast<int>(rng.below(18)), wide = static_cast<int>(stretch * high);
    const auto grey = static_cast<std::uint8_t>(30 + rng.below(190));
    for (int y = std::max(y0 - high, 0); y < std::min(y0 + high, sharp.height()); ++y)
      for (int x = std::max(x0 - wide, 0); x < std::min(x0 + wide, sharp.width()); ++x)
        if (std::hypot((x - x0) / stretch, y - y0) < high) sharp.at(x, y) = grey;
  }
  Image scene = sharp;
  for (int y = 1; y + 1 < scene.height(); ++y)
    for (int x = 1; x + 1 < scene.width(); ++x) {
      const int around = sharp.at(x - 1, y) + sharp.at(x + 1, y) + sharp.at(x, y - 1) + sharp.at(x, y + 1);
      scene.at(x, y) = static_cast<std::uint8_t>((8 * sharp.at(x, y) + 3 * around) / 20);
    }
  return scene;
}

/// The scene from (x0, y0) on, moved by `way` during the exposure.
Image exposed(const Image& scene, int x0, int y0, const Vec2& way) {
  Image image(kWidth, kHeight);
  const int steps = 1 + static_cast<int>(way.norm());
  std::vector<int> sums(static_cast<std::size_t>(kWidth) * kHeight);
  for (int i = 0; i <= steps; ++i) {
    const Vec2 moved = (static_cast<double>(i) / steps - 0.5) * way;
    const int left = x0 + static_cast<int>(std::lround(moved.x())), top = y0 + static_cast<int>(std::lround(moved.y()));
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) sums[static_cast<std::size_t>(y * kWidth + x)] += scene.at(left + x, top + y);
  }
  for (std::size_t k = 0; k < sums.size(); ++k) image.row(0)[k] = static_cast<std::uint8_t>((sums[k] + steps / 2) / (steps + 1));
  return image;
}

/// A camera that turns about another axis in every image. Its flow is nearly the same everywhere in the image.
Blur measured(double exposure_s, double stretch, double most_degrees = 180) {
  Evidence evidence;
  evidence.rig.cameras.assign(
      2, {Camera(PinholeRadtan{.fx = kFocal_px, .fy = kFocal_px, .cx = kWidth / 2.0, .cy = kHeight / 2.0}, kWidth, kHeight), {}});
  const Image scene = discs(stretch);
  Rng rng(7);
  std::vector<ImuSample> readings;
  for (int k = 0; k < kImages; ++k) {
    const double angle = rng.uniform(0, most_degrees / 180 * std::numbers::pi),
                 rate = k % 4 == 0 ? 0 : kRate_radps * rng.uniform(0.5, 1);
    const Vec3 rate_C = rate * Vec3(-std::sin(angle), std::cos(angle), 0);
    const Vec2 velocity = kFocal_px * Vec2(-rate_C.y(), rate_C.x());
    const int x0 = 20 + static_cast<int>(rng.below(kWidth - 40)), y0 = 20 + static_cast<int>(rng.below(kHeight - 40));
    SeenFrame frame;
    frame.t = Time{1'000'000'000 + k * kImage.ns};
    Pyramid pyramid;
    const Image image = exposed(scene, x0, y0, exposure_s * velocity);
    pyramid.build(image.view(), 3);
    frame.gradients = gradient_energies(pyramid);
    for (int i = -5; i < 5; ++i) readings.push_back({frame.t + Duration{5'000'000 * i}, rate_C, Vec3(0, 0, 9.81)});
    evidence.frames.push_back(std::move(frame));
  }
  return measure_blur(evidence, ImuSeries(readings), evidence.rig);
}

TEST(Blur, MeasuresTheExposure) {
  const Blur blur = measured(0.03, 1);
  EXPECT_NEAR(blur.exposure_s, 0.03, 0.4 * 0.03);
  EXPECT_NEAR(blur.exposure_s, 0.03, 2 * blur.sigma_s);
  const auto finding = check_blur(blur);
  ASSERT_TRUE(finding);
  EXPECT_EQ(finding->kind, FindingKind::blur);
}

TEST(Blur, IsNotSeenInSharpImages) {
  const Blur blur = measured(0.002, 1);
  EXPECT_LT(blur.exposure_s, 0.006);
  EXPECT_FALSE(check_blur(blur));
}

TEST(Blur, IsNotSeenWhereTheScenesEdgesRunAsTheCameraMoves) {
  const Blur blur = measured(0.002, 4, 20);
  EXPECT_LT(blur.length_px(), 8);
  EXPECT_FALSE(check_blur(blur));
}

TEST(Blur, NeedsImagesThatTurn) {
  Evidence evidence;
  EXPECT_EQ(measure_blur(evidence, ImuSeries({}), evidence.rig).images, 0);
  EXPECT_FALSE(check_blur({}));
}

}  // namespace blur_test
}  // namespace fbvins
