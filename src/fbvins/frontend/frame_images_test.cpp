// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/frame_images.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace frame_images_test {

constexpr int kWidth = 96, kHeight = 64;

StereoRig rig() {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{.fx = 80, .fy = 80, .cx = 48, .cy = 32}, kWidth, kHeight), {}});
  return rig;
}

StereoFrame frame(double t_s, std::shared_ptr<const Image> left, std::shared_ptr<const Image> right = nullptr) {
  return {Time{} + Duration::from_seconds(t_s), {std::move(left), std::move(right)}};
}

std::shared_ptr<const Image> grey(std::uint8_t value, int width = kWidth) {
  return std::make_shared<const Image>(width, kHeight, value);
}

TEST(FrameImages, OnlyImagesOfTheCalibrationsSizeAreUsedAndAllAreMeasured) {
  FrameImages images(rig(), 2);
  FrontendStats stats;
  images.take(frame(0, grey(90), grey(40, 80)), stats);
  EXPECT_EQ(images.left().levels(), 2);
  EXPECT_TRUE(images.right().empty());
  EXPECT_NEAR(stats.mean_brightness_left, 90, 0.5);
  EXPECT_NEAR(stats.mean_brightness_right, 40, 0.5);
  images.take(frame(0.05, nullptr), stats);
  EXPECT_TRUE(images.left().empty());
  EXPECT_EQ(stats.mean_brightness_left, 0);
}

TEST(FrameImages, TheImageBeforeIsThatOfTheLastAdvance) {
  FrameImages images(rig(), 1);
  FrontendStats stats;
  images.take(frame(0, grey(10)), stats);
  EXPECT_FALSE(images.has_before());
  images.advance();
  images.take(frame(0.05, nullptr), stats);  // nothing to advance from
  images.take(frame(0.1, grey(20)), stats);
  ASSERT_TRUE(images.has_before());
  EXPECT_EQ(images.before().level(0).row(3)[5], 10);
  EXPECT_EQ(images.left().level(0).row(3)[5], 20);
  EXPECT_EQ(images.t_before(), Time{});
}

TEST(FrameImages, NothingCarriesOverAGapOrBackInTime) {
  for (const double t_s : {0.05, 0.61, -0.05}) {
    FrameImages images(rig(), 1);
    FrontendStats stats;
    images.take(frame(0, grey(10)), stats);
    EXPECT_FALSE(images.forget_before_gap(0.6)) << "there is no image before";
    images.advance();
    images.take(frame(t_s, grey(20)), stats);
    EXPECT_EQ(images.forget_before_gap(0.6), t_s != 0.05) << t_s;
    EXPECT_EQ(images.has_before(), t_s == 0.05) << t_s;
    EXPECT_FALSE(images.forget_before_gap(0.6)) << "reported once";
  }
}

}  // namespace frame_images_test
}  // namespace fbvins
