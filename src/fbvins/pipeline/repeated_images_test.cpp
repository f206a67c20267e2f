// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/repeated_images.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace repeated_images_test {

constexpr double kPeriod_s = 0.05;

std::shared_ptr<const Image> picture(std::uint64_t seed) {
  Image image(64, 48);
  Rng rng(seed);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) image.row(y)[x] = static_cast<std::uint8_t>(rng.uniform(0, 256));
  return std::make_shared<const Image>(std::move(image));
}

StereoFrame frame(int k, std::uint64_t left, std::uint64_t right) {
  return {Time{} + Duration::from_seconds(1 + kPeriod_s * k), {picture(left), picture(right)}};
}

/// Readings of a constant rate up to frame k.
ImuSegment turning(int k, double rate_radps, int frames = 1) {
  ImuSegment out;
  for (int i = 0; i <= 10 * frames; ++i)
    out.samples.push_back(
        {Time{} + Duration::from_seconds(1 + kPeriod_s * (k - frames + 0.1 * i)), Vec3(0, 0, rate_radps), Vec3(0, 0, 9.81)});
  return out;
}

TEST(RepeatedImageFilter, OneThatComesAgainIsTakenOutWhereTheVehicleTurns) {
  RepeatedImageFilter repeated;
  StereoFrame first = frame(0, 1, 101), again = frame(1, 1, 101), right = frame(2, 2, 101), next = frame(3, 3, 103);
  EXPECT_TRUE(repeated.take_out(first, {}));
  EXPECT_FALSE(repeated.take_out(again, turning(1, 0.4))) << "no image is left";
  EXPECT_TRUE(repeated.take_out(right, turning(2, 0.4, 2)));
  EXPECT_TRUE(right.left() && !right.right());
  EXPECT_TRUE(repeated.take_out(next, turning(3, 0.4)));
  EXPECT_TRUE(next.left() && next.right());
  EXPECT_EQ(repeated.count(), 3);
}

TEST(RepeatedImageFilter, EqualImagesOfAVehicleAtRestAreKeptUntilTheCameraIsKnownToRepeat) {
  RepeatedImageFilter repeated;
  for (int k = 0; k < 5; ++k) {
    StereoFrame still = frame(k, 1, 101);
    EXPECT_TRUE(repeated.take_out(still, k == 0 ? ImuSegment{} : turning(k, 0.04))) << "a bias of the gyroscope is no turn";
    EXPECT_TRUE(still.left() && still.right());
  }
  StereoFrame turned = frame(5, 1, 101), at_rest = frame(6, 1, 101);
  EXPECT_FALSE(repeated.take_out(turned, turning(5, 1)));
  EXPECT_FALSE(repeated.take_out(at_rest, turning(6, 0, 2)));
}

TEST(RepeatedImageFilter, APathThatReturnsShowsTheSameImage) {
  RepeatedImageFilter repeated;
  StereoFrame there = frame(0, 1, 101), away = frame(1, 2, 102), back = frame(2, 1, 101), in_turns = frame(3, 2, 102);
  EXPECT_TRUE(repeated.take_out(there, {}));
  EXPECT_TRUE(repeated.take_out(away, turning(1, 0.5)));
  EXPECT_TRUE(repeated.take_out(back, turning(2, -0.5)));
  EXPECT_TRUE(back.left());
  EXPECT_FALSE(repeated.take_out(in_turns, turning(3, 1.5))) << "it was taken elsewhere";
}

TEST(RepeatedImageFilter, BlackImagesAreKept) {
  RepeatedImageFilter repeated;
  for (int k = 0; k < 3; ++k) {
    StereoFrame dark{Time{} + Duration::from_seconds(1 + kPeriod_s * k), {std::make_shared<const Image>(64, 48)}};
    EXPECT_TRUE(repeated.take_out(dark, k == 0 ? ImuSegment{} : turning(k, 2)));
    EXPECT_TRUE(dark.left());
  }
}

}  // namespace repeated_images_test
}  // namespace fbvins
