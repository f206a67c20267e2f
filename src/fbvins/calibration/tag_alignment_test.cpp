// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/tag_alignment.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "fbvins/calibration/board_image.hpp"
#include "fbvins/calibration/simulated_board.hpp"

namespace fbvins {
namespace tag_alignment_test {

#ifdef FBVINS_WITH_APRILTAG

constexpr double kSize_m = 0.2;

Camera camera() { return example_cameras()[0]; }

/// Grey values as of a sensor whose response is a power of the light.
Image image_of(const Pose<Cn, T>& T_CnT, double power, std::uint64_t seed) {
  Rng rng(seed);
  const Board tag{.columns = 1, .rows = 1, .size_m = kSize_m, .spacing = 0.3};
  Image image = BoardCamera(camera(), *BoardPattern::create(tag)).render({T_CnT}, {.noise = 1}, rng);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      std::uint8_t& grey = image.row(y)[x];
      grey = static_cast<std::uint8_t>(std::lround(255 * std::pow(grey / 255.0, power)));
    }
  return image;
}

/// The tag `distance_m` ahead, turned by an angle from facing the camera.
Pose<Cn, T> ahead(double distance_m, double turned_rad) {
  const Quat q = so3_exp(turned_rad * Vec3(0.6, 0.8, 0)) * Quat(0, 1, 0, 0);
  return {q, Vec3(Vec3(0.1, -0.05, distance_m) - q * Vec3(0.5 * kSize_m, 0.5 * kSize_m, 0))};
}

Pose<Cn, T> off(const Pose<Cn, T>& truth, Rng& rng) {
  const auto vector = [&](double s) { return Vec3(s * rng.normal(), s * rng.normal(), s * rng.normal()); };
  return {(truth.q * so3_exp(vector(0.003))).normalized(), Vec3(truth.p + 0.001 * truth.p.norm() * vector(0.5))};
}

Vec6 error(const AlignedTag& tag, const Pose<Cn, T>& truth) {
  Vec6 e;
  e << tag.T_CnT.p - truth.p, so3_log(truth.q.conjugate() * tag.T_CnT.q);
  return e;
}

TEST(TagAlignment, FindsThePoseWhateverTheResponseAndIsAsCertainAsItSays) {
  Rng rng(5);
  double nees = 0, depth = 0;
  int n = 0;
  for (const double power : {1.0, 0.5})
    for (const double distance_m : {0.8, 1.5, 2.2})
      for (const double turned : {0.3, 0.6, 0.9}) {
        const Pose<Cn, T> truth = ahead(distance_m, turned);
        const Image image = image_of(truth, power, 10 + static_cast<std::uint64_t>(n));
        const auto tag = align_tag(image.view(), camera(), *tag_cells(0), kSize_m, off(truth, rng));
        ASSERT_TRUE(tag) << power << " " << distance_m << " " << turned;
        const Vec6 e = error(*tag, truth);
        EXPECT_LT(e.head<3>().norm(), 0.005 * distance_m) << power << " " << distance_m << " " << turned;
        nees += e.dot(tag->covariance.inverse() * e), depth += e.z() / distance_m, ++n;
      }
  EXPECT_LT(std::abs(depth / n), 0.001) << "tags look neither smaller nor larger than they are";
  EXPECT_LT(nees / n, 6) << "6 where consistent";
  EXPECT_GT(nees / n, 0.5);
}

TEST(TagAlignment, WhatIsNotThatTagIsRefused) {
  const Pose<Cn, T> truth = ahead(1.2, 0.4);
  Image image = image_of(truth, 1, 3);
  EXPECT_TRUE(align_tag(image.view(), camera(), *tag_cells(0), kSize_m, truth));
  EXPECT_FALSE(align_tag(image.view(), camera(), *tag_cells(7), kSize_m, truth)) << "another one";
  EXPECT_FALSE(align_tag(image.view(), camera(), *tag_cells(0), kSize_m, ahead(12, 0.4))) << "too small";
  EXPECT_FALSE(align_tag(image.view(), camera(), *tag_cells(0), kSize_m, ahead(-1, 0.4))) << "behind the camera";
  const Vec2 middle = *camera().pixel_of(truth * Vec3(0.15, 0.1, 0));
  for (int y = -25; y <= 25; ++y)
    for (int x = -12; x <= 12; ++x) image.row(static_cast<int>(middle.y()) + y)[static_cast<int>(middle.x()) + x] = 230;
  EXPECT_FALSE(align_tag(image.view(), camera(), *tag_cells(0), kSize_m, truth)) << "covered";
  EXPECT_FALSE(align_tag(Image(752, 480).view(), camera(), *tag_cells(0), kSize_m, truth)) << "black";
}

#endif

}  // namespace tag_alignment_test
}  // namespace fbvins
