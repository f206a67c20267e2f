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

StereoRig rig() {
  return with_depth(with_cameras({}, {{camera(), {}}}), {.noise_at_1m_m = kNoise_m, .nearest_m = 0.3, .farthest_m = 6});
}

const DepthReader& reader() {
  static const DepthReader reader(rig());
  return reader;
}

TEST(DepthReader, DepthsAreObservedFarToTheRightOfTheLeftCamera) {
  const Pose<B, C0> T_BC0(so3_exp(Vec3(0.4, -0.3, 0.2)), Vec3(0.1, 0.2, 0.3));
  EXPECT_LT((T_BC0.inverse() * depth_observer(T_BC0).p - Vec3(kDepthBaseline_m, 0, 0)).norm(), 1e-12);
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

/// A sensor of another size, lens and place: 60 mm to the right, turned by a few degrees.
StereoRig apart() {
  StereoRig out = rig();
  out.cameras[0].T_BC = {so3_exp(Vec3(0.4, -0.3, 0.2)), Vec3(0.1, 0.2, 0.3)};
  const Camera own(PinholeRadtan{.fx = 90, .fy = 92, .cx = 49, .cy = 41, .k1 = -0.1, .k2 = 0.02}, 100, 80);
  out.depth->own = MountedCamera{own, out.T_BC0() * Pose<C0, C0>(so3_exp(Vec3(0.03, -0.05, 0.04)), Vec3(0.06, 0.01, -0.005))};
  return out;
}

/// A turned wall and a plate before it: where a ray from `p` meets them first, by how much of `d`.
double met(const Vec3& p, const Vec3& d) {
  const Vec3 wall(0.15, 0.05, 0.4);  // wall . X = 1
  const double plate = (1 - p.z()) / d.z();
  const Vec3 at = p + plate * d;
  return at.x() > -0.1 && at.x() < 0.25 && std::abs(at.y()) < 0.2 ? plate : (1 - wall.dot(p)) / wall.dot(d);
}

DepthImage seen_apart(const StereoRig& rig, const std::function<double(double)>& noisy) {
  const auto& [own, T_BE] = *rig.depth->own;
  const Pose<C0, C0> T_CE = rig.T_BC0().inverse() * T_BE;
  DepthImage image{own.width(), own.height(), {}};
  for (int y = 0; y < own.height(); ++y)
    for (int x = 0; x < own.width(); ++x)
      image.mm.push_back(
          static_cast<std::uint16_t>(std::lround(1000 * noisy(met(T_CE.p, T_CE.q * own.undistort(Vec2(x, y))->homogeneous())))));
  return image;
}

TEST(DepthReader, OfASensorThatLiesElsewhereTheDepthIsAlongTheCamerasOwnZ) {
  Rng rng(5, 1);
  const StereoRig rig = apart();
  const DepthReader reader(rig);
  const DepthImage exact = seen_apart(rig, [](double z) { return z; });
  const DepthImage noisy = seen_apart(rig, [&](double z) { return 1 / (1 / z + kNoise_m * rng.normal()); });
  ASSERT_TRUE(reader.is_usable(&exact));
  int count = 0, within = 0, on_plate = 0;
  for (double y = 4.3; y < kHeight - 4; ++y)
    for (double x = 4.1; x < kWidth - 4; ++x) {
      const double truth = 1 / met(Vec3::Zero(), camera().undistort(Vec2(x, y))->homogeneous());
      if (const auto depth = reader.at(exact, Vec2(x, y))) {
        EXPECT_NEAR(depth->value, truth, 0.004) << x << ' ' << y;
      }
      if (const auto depth = reader.at(noisy, Vec2(x, y)))
        ++count, within += std::abs(depth->value - truth) < depth->sigma, on_plate += truth == 1;
    }
  EXPECT_GT(count, 1200) << "of 2240";
  EXPECT_GT(on_plate, 100);
  EXPECT_GT(within, 0.9 * count);
}

TEST(DepthReader, NothingWhereSomethingNearerHidesFromTheSensorWhatTheCameraSees) {
  StereoRig rig = apart();
  rig.depth->own->T_BC = rig.T_BC0() * Pose<C0, C0>(Quat::Identity(), Vec3(0.25, 0, 0));
  const DepthReader reader(rig);
  const DepthImage image = seen_apart(rig, [](double z) { return z; });
  const Pose<C0, C0> T_EC = rig.depth->own->T_BC.inverse() * rig.T_BC0();
  int hidden = 0;
  for (double y = 14; y < 34; ++y)
    for (double x = 4; x < kWidth - 4; ++x) {
      const Vec3 ray = camera().undistort(Vec2(x, y))->homogeneous(), p_C = met(Vec3::Zero(), ray) * ray;
      const Vec3 from = T_EC.inverse().p, along = p_C - from;
      if (met(from, along) > 0.99) continue;  // the sensor sees it, too
      ++hidden;
      EXPECT_FALSE(reader.at(image, Vec2(x, y))) << x << ' ' << y;
    }
  EXPECT_GT(hidden, 100);
}

}  // namespace depth_reader_test
}  // namespace fbvins
