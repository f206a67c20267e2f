// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/camera.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace camera_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

// Numbers like those of a EuRoC camera, and of a fisheye with about 150 degrees.
Camera euroc_like() {
  return {PinholeRadtan{458.654, 457.296, 367.215, 248.375, -0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}, 752, 480};
}
Camera fisheye() { return {KannalaBrandt{190.98, 190.97, 254.93, 256.90, 0.0034, 0.00072, -0.0020, 0.00020}, 512, 512}; }
// Like a RealSense's colour camera by plumb_bob, an OAK's by the rational model.
Camera with_k3() { return {PinholeRadtan5{434.1, 433.2, 321.7, 238.5, -0.055, 0.066, -3e-4, 6e-4, -0.021}, 640, 480}; }
Camera rational() {
  return {PinholeRational{505.0, 505.2, 321.0, 243.5, 0.52, -2.44, 4e-4, -1e-4, 1.42, 0.40, -2.26, 1.35}, 640, 480};
}
Camera strong_barrel() { return {PinholeRadtan{300, 310, 320, 240, -0.3, 0.0, 0.001, -0.002}, 640, 480}; }

void expect_round_trip_over_image(const Camera& cam, double border_px, double max_distance_px) {
  for (double v = -border_px; v <= cam.height() - 1 + border_px; v += 7.5) {
    for (double u = -border_px; u <= cam.width() - 1 + border_px; u += 7.5) {
      if (std::hypot(u - 0.5 * cam.width(), v - 0.5 * cam.height()) > max_distance_px) continue;
      const auto n = cam.undistort({u, v});
      ASSERT_TRUE(n) << u << ' ' << v;
      EXPECT_LT((cam.distort(*n) - Vec2(u, v)).norm(), 1e-9) << u << ' ' << v;
      const auto again = cam.project(3.7 * Vec3(n->x(), n->y(), 1));
      ASSERT_TRUE(again) << u << ' ' << v;
      EXPECT_LT((*again - Vec2(u, v)).norm(), 1e-9);
    }
  }
}

TEST(Camera, EveryPixelOfEurocImageUndistortsAndComesBack) { expect_round_trip_over_image(euroc_like(), 20, 1e9); }
TEST(Camera, EveryPixelOfLensesWithMoreCoefficientsComesBack) {
  expect_round_trip_over_image(with_k3(), 20, 1e9);
  expect_round_trip_over_image(rational(), 20, 1e9);
}
TEST(Camera, FisheyePixelsWithinItsCircleUndistortAndComeBack) {
  expect_round_trip_over_image(fisheye(), 0, 1.45 * 190);  // 83 degrees
  EXPECT_FALSE(fisheye().undistort({0, 0}));               // the corners look backwards: no x/z, y/z
}

TEST(Camera, RandomRaysComeBack) {
  Rng rng(5);
  for (const Camera& cam : {euroc_like(), fisheye(), strong_barrel(), with_k3(), rational()}) {
    for (int i = 0; i < 2000; ++i) {
      const double angle = rng.uniform(0, 6.28);
      const double radius = rng.uniform(0, 0.95 * std::min(cam.max_normalised_radius(), 4.0));
      const Vec2 n(radius * std::cos(angle), radius * std::sin(angle));
      const auto back = cam.undistort(cam.distort(n));
      ASSERT_TRUE(back) << cam.model_name() << ' ' << n.transpose();
      EXPECT_LT((*back - n).norm(), 1e-8 * (1 + radius)) << cam.model_name() << ' ' << n.transpose();
    }
  }
}

TEST(Camera, JacobianIsTheDerivativeOfDistort) {
  Rng rng(6);
  for (const Camera& cam : {euroc_like(), fisheye(), strong_barrel(), with_k3(), rational()}) {
    for (int i = 0; i < 500; ++i) {
      // every tenth point lies so near to the axis that the series is used
      const double scale = i % 10 == 0 ? 1e-5 : 0.8;
      const Vec2 n(scale * rng.uniform(-1, 1), scale * rng.uniform(-1, 1));
      Mat2 J;
      cam.distort(n, &J);
      for (int k = 0; k < 2; ++k) {
        const double h = 1e-6;
        const Vec2 d = h * Vec2::Unit(k);
        const Vec2 numeric = (cam.distort(n + d) - cam.distort(n - d)) / (2 * h);
        EXPECT_LT((numeric - J.col(k)).norm(), 1e-5 * cam.focal_px() / 100) << cam.model_name() << ' ' << n.transpose();
      }
    }
  }
}

TEST(Camera, TheAxisMapsToThePrincipalPoint) {
  EXPECT_EQ(euroc_like().distort({0, 0}), Vec2(367.215, 248.375));
  EXPECT_EQ(fisheye().distort({0, 0}), Vec2(254.93, 256.90));
  EXPECT_LT(fisheye().undistort({254.93, 256.90})->norm(), 1e-15);
}

TEST(Camera, FisheyeMatchesItsDefinition) {
  // At 60 degrees the distorted radius is theta + k1 theta^3 + ...
  const Camera cam = fisheye();
  const double theta = 1.0471975511965976, t2 = theta * theta;
  const double expected = theta * (1 + t2 * (0.0034 + t2 * (0.00072 + t2 * (-0.0020 + t2 * 0.00020))));
  const auto px = cam.project({std::tan(theta), 0, 1});
  ASSERT_TRUE(px);
  EXPECT_NEAR(px->x(), 254.93 + 190.98 * expected, 1e-9);
}

TEST(Camera, PointsBehindOrInTheCameraPlaneDoNotProject) {
  for (const Camera& cam : {euroc_like(), fisheye()}) {
    EXPECT_FALSE(cam.project({0, 0, -1}));
    EXPECT_FALSE(cam.project({0.1, 0.1, 0}));
    EXPECT_FALSE(cam.project({0, 0, 0}));
    EXPECT_TRUE(cam.project({0, 0, 1e-3}));
    EXPECT_FALSE(cam.project({1e6, 0, 1}));
  }
}

TEST(Camera, NotANumberAndInfinityAreRefused) {
  for (const Camera& cam : {euroc_like(), fisheye()}) {
    for (double bad : {kNaN, kInf, -kInf}) {
      EXPECT_FALSE(cam.project({bad, 0, 1}));
      EXPECT_FALSE(cam.project({0, bad, 1}));
      EXPECT_FALSE(cam.undistort({bad, 1}));
      EXPECT_FALSE(cam.undistort({1, bad}));
      EXPECT_FALSE(cam.inside({bad, 1}));
    }
    EXPECT_FALSE(cam.project({0, 0, kNaN}));
  }
}

TEST(Camera, BeyondTheMonotonicPartThereIsNoInverse) {
  // r (1 - 0.3 r^2) grows until r = 1/sqrt(0.9), where it reaches 0.703.
  const Camera cam(PinholeRadtan{300, 300, 320, 240, -0.3, 0, 0, 0}, 640, 480);
  EXPECT_NEAR(cam.max_normalised_radius(), 1 / std::sqrt(0.9), 1e-9);
  EXPECT_TRUE(cam.undistort({320 + 300 * 0.70, 240}));
  EXPECT_FALSE(cam.undistort({320 + 300 * 0.71, 240}));
  EXPECT_TRUE(cam.project({1.05, 0, 1}));
  EXPECT_FALSE(cam.project({1.06, 0, 1}));  // would fold back into the image
}

TEST(Camera, FoldingByTangentialDistortionIsRefused) {
  const Camera cam(PinholeRadtan{300, 300, 320, 240, 0, 0, 0, 0.5}, 640, 480);
  // dx'/dx = 1 + 6 p2 x = 1 + 3 x turns negative left of x = -1/3
  EXPECT_TRUE(cam.project({-0.3, 0, 1}));
  EXPECT_FALSE(cam.project({-0.4, 0, 1}));
}

TEST(Camera, InsideCountsPixelCentres) {
  const Camera cam = euroc_like();
  EXPECT_TRUE(cam.inside({0, 0}));
  EXPECT_TRUE(cam.inside({751, 479}));
  EXPECT_FALSE(cam.inside({751.01, 479}));
  EXPECT_FALSE(cam.inside({-0.01, 3}));
  EXPECT_FALSE(cam.inside({9, 100}, 10));
}

TEST(StereoRig, RelativePoseTakesLeftToRight) {
  StereoRig rig;
  rig.cameras.resize(2);
  rig.cameras[1].T_BC.p = Vec3(0.11, 0, 0);
  EXPECT_LT((rig.T_C1C0() * Vec3(0, 0, 1) - Vec3(-0.11, 0, 1)).norm(), 1e-15);
}

}  // namespace camera_test
}  // namespace fbvins
