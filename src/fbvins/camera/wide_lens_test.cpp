// SPDX-License-Identifier: Apache-2.0
// Double sphere, extended unified and unified with distortion: models that also describe rays pointing backwards.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace wide_lens_test {

// Numbers like those of real calibrations: fisheyes of some 150 degrees across, and a mild wide angle.
Camera double_sphere() { return {DoubleSphere{158.3, 158.2, 254.9, 256.9, -0.172, 0.593}, 512, 512}; }
Camera double_sphere_outwards() { return {DoubleSphere{364.8, 365.1, 376, 240, 0.31, 0.42}, 752, 480}; }
Camera extended_unified() { return {ExtendedUnified{190.9, 190.8, 254.9, 256.9, 0.63, 1.04}, 512, 512}; }
Camera flat_extended_unified() { return {ExtendedUnified{460, 459, 376, 240, 0.3, 0.8}, 752, 480}; }
Camera unified() { return {UnifiedRadtan{833.0, 830.3, 373.8, 253.7, 0.8007, -0.3352, 0.1321, 0.00056, 0.00058}, 752, 480}; }
std::vector<Camera> all() {
  return {double_sphere(), double_sphere_outwards(), extended_unified(), flat_extended_unified(), unified()};
}

/// The definitions, of a point and not of x/z, y/z.
Vec2 as_defined(const DoubleSphere& m, const Vec3& p) {
  const double d1 = p.norm(), w = m.xi * d1 + p.z(), d2 = std::hypot(p.x(), p.y(), w);
  const double D = m.alpha * d2 + (1 - m.alpha) * w;
  return {m.fx * p.x() / D + m.cx, m.fy * p.y() / D + m.cy};
}
Vec2 as_defined(const ExtendedUnified& m, const Vec3& p) {
  const double d = std::sqrt(m.beta * (p.x() * p.x() + p.y() * p.y()) + p.z() * p.z());
  const double D = m.alpha * d + (1 - m.alpha) * p.z();
  return {m.fx * p.x() / D + m.cx, m.fy * p.y() / D + m.cy};
}
Vec2 as_defined(const UnifiedRadtan& m, const Vec3& p) {
  const double D = m.xi * p.norm() + p.z();
  return Camera(PinholeRadtan{m.fx, m.fy, m.cx, m.cy, m.k1, m.k2, m.p1, m.p2}, 1, 1).distort({p.x() / D, p.y() / D});
}
Vec2 as_defined(const auto&, const Vec3&) { return Vec2::Constant(NAN); }

/// A point up to `largest` off the axis, rad, at 0.1 to 10 m.
Vec3 random_point(Rng& rng, double largest) {
  const double azimuth = rng.uniform(0, 6.2831), off_axis = rng.uniform(0, largest), range_m = rng.uniform(0.1, 10);
  return range_m * Vec3(std::sin(off_axis) * std::cos(azimuth), std::sin(off_axis) * std::sin(azimuth), std::cos(off_axis));
}

TEST(WideLens, ProjectsAsItIsDefined) {
  Rng rng(1);
  for (const Camera& camera : all())
    for (int i = 0; i < 500; ++i) {
      const Vec3 p = random_point(rng, camera.model_name() == "omni-radtan" ? 1.0 : 1.5);
      const auto pixel = camera.project(p);
      ASSERT_TRUE(pixel) << camera.model_name() << ' ' << p.transpose();
      const Vec2 expected = std::visit([&](const auto& m) { return as_defined(m, p); }, camera.model());
      EXPECT_LT((*pixel - expected).norm(), 1e-9) << camera.model_name() << ' ' << p.transpose();
    }
}

TEST(WideLens, EachRayComesBackFromItsPixel) {
  Rng rng(2);
  for (const Camera& camera : all()) {
    const double largest = std::min(1.55, std::atan(camera.max_normalised_radius()) - 0.01);
    for (int i = 0; i < 2000; ++i) {
      const Vec3 p = random_point(rng, largest);
      const Vec2 n(p.x() / p.z(), p.y() / p.z());
      const auto pixel = camera.project(p);
      ASSERT_TRUE(pixel) << camera.model_name() << ' ' << n.transpose();
      const auto back = camera.undistort(*pixel);
      ASSERT_TRUE(back) << camera.model_name() << ' ' << n.transpose();
      // As directions: x/z is the tangent, whose digits are lost towards 90 degrees.
      const Vec3 ray = Vec3(back->x(), back->y(), 1).normalized();
      EXPECT_LT(ray.cross(p.normalized()).norm(), 1e-11) << camera.model_name() << ' ' << n.transpose();
    }
  }
}

TEST(WideLens, EachPixelThatLooksForwardComesBack) {
  for (const Camera& camera : all()) {
    int with_ray = 0, pixels = 0;
    for (double v = 0; v <= camera.height() - 1; v += 6.5)
      for (double u = 0; u <= camera.width() - 1; u += 6.5, ++pixels) {
        const auto n = camera.undistort({u, v});
        if (!n) continue;
        ++with_ray;
        EXPECT_LT((camera.distort(*n) - Vec2(u, v)).norm(), 1e-9) << camera.model_name() << ' ' << u << ' ' << v;
        EXPECT_TRUE(camera.project({2 * n->x(), 2 * n->y(), 2})) << camera.model_name() << ' ' << u << ' ' << v;
      }
    EXPECT_GT(with_ray, 0.8 * pixels) << camera.model_name();
  }
}

TEST(WideLens, JacobianIsTheDerivativeOfDistort) {
  Rng rng(3);
  for (const Camera& camera : all())
    for (int i = 0; i < 500; ++i) {
      const double scale = i % 10 == 0 ? 1e-5 : 1.2, h = 1e-6;
      const Vec2 n(scale * rng.uniform(-1, 1), scale * rng.uniform(-1, 1));
      Mat2 J;
      camera.distort(n, &J);
      for (int k = 0; k < 2; ++k) {
        const Vec2 d = h * Vec2::Unit(k);
        const Vec2 numeric = (camera.distort(n + d) - camera.distort(n - d)) / (2 * h);
        EXPECT_LT((numeric - J.col(k)).norm(), 1e-8 * camera.focal_px()) << camera.model_name() << ' ' << n.transpose();
      }
    }
}

/// At xi = 0 the double sphere is the unified model, which is the extended one at beta = 1, and Mei's without distortion.
TEST(WideLens, TheFocalLengthIsPixelsARadianAtTheAxis) {
  constexpr double kAngle_rad = 1e-3;
  for (const Camera& camera : all()) {
    const Vec2 axis = *camera.project(Vec3(0, 0, 1));
    const double across = camera.project(Vec3(kAngle_rad, 0, 1))->x() - axis.x();
    const double down = camera.project(Vec3(0, kAngle_rad, 1))->y() - axis.y();
    EXPECT_NEAR(0.5 * (across + down) / kAngle_rad, camera.focal_px(), 1e-3 * camera.focal_px()) << camera.model_name();
  }
}

TEST(WideLens, TheModelsAgreeWhereTheyCoincide) {
  const double alpha = 0.4, xi = alpha / (1 - alpha), f = 200 / (1 - alpha);
  const Camera cameras[] = {{DoubleSphere{200, 200, 320, 240, 0, alpha}, 640, 480},
                            {ExtendedUnified{200, 200, 320, 240, alpha, 1}, 640, 480},
                            {UnifiedRadtan{f, f, 320, 240, xi, 0, 0, 0, 0}, 640, 480}};
  for (double x = -3; x < 3; x += 0.17)
    for (const Camera& camera : cameras)
      EXPECT_LT((camera.distort({x, 0.6 - x}) - cameras[0].distort({x, 0.6 - x})).norm(), 1e-10) << camera.model_name() << x;
}

TEST(WideLens, WhatLooksBackwardsHasNoNormalisedCoordinates) {
  for (const Camera& camera : {double_sphere(), extended_unified()}) {
    EXPECT_FALSE(camera.undistort({0, 0})) << camera.model_name();  // a corner
    EXPECT_TRUE(camera.undistort({0, 256})) << camera.model_name();
    EXPECT_FALSE(camera.project({0.1, 0.1, -1}));
    EXPECT_FALSE(camera.project({0.1, 0.1, 0}));
    EXPECT_FALSE(camera.undistort({std::numeric_limits<double>::quiet_NaN(), 1}));
    EXPECT_FALSE(camera.undistort({1, std::numeric_limits<double>::infinity()}));
    EXPECT_FALSE(camera.undistort({1e9, -1e9}));
  }
}

TEST(WideLens, AnImageWhoseEdgesLookBackwardsIsRecognised) {
  for (const Camera& camera : all()) EXPECT_FALSE(camera.sees_backwards()) << camera.model_name();
  EXPECT_TRUE(Camera(DoubleSphere{100, 100, 256, 256, -0.2, 0.6}, 512, 512).sees_backwards());
  EXPECT_TRUE(Camera(ExtendedUnified{100, 100, 256, 256, 0.63, 1.04}, 512, 512).sees_backwards());
  EXPECT_TRUE(Camera(KannalaBrandt{150, 150, 256, 256, 0, 0, 0, 0}, 512, 512).sees_backwards());   // 1.7 rad to each side
  EXPECT_FALSE(Camera(KannalaBrandt{190, 190, 256, 256, 0, 0, 0, 0}, 512, 512).sees_backwards());  // 1.35 rad
  // A barrel distortion whose polynomial stops growing has no rays at the edges, either, but is no lens of 180 degrees.
  EXPECT_FALSE(Camera(PinholeRadtan{200, 200, 320, 240, -0.3, 0, 0, 0}, 640, 480).sees_backwards());
}

}  // namespace wide_lens_test
}  // namespace fbvins
