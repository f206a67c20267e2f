// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/fixed_view.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "fbvins/doctor/imu_series.hpp"
#include "tests/support/noise_texture.hpp"

namespace fbvins {
namespace fixed_view_test {

constexpr int kWidth = 320, kHeight = 240, kViews = 28;
constexpr double kFocal_px = 250, kApart_s = 0.5;

StereoRig rig() {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{kFocal_px, kFocal_px, 160, 120, 0, 0, 0, 0}, kWidth, kHeight), {}});
  rig.cameras[1].T_BC.p = Vec3(0.1, 0, 0);
  return rig;
}

/// A bar from the lower edge, and the place of the camera in front of the scene at a view, px.
const MaskRectangle kBar{140, 150, 40, 90};
Vec2 where(int view) { return Vec2(60 * std::sin(1.9 * view), 40 * std::cos(2.7 * view)); }

/// Readings of a rig that swings by 0.1 rad from view to view, about two axes.
std::vector<ImuSample> swinging(bool swings) {
  std::vector<ImuSample> imu;
  for (int i = 0; i < 200 * kViews * kApart_s + 200; ++i) {
    const double t = 0.005 * i;
    const int view = static_cast<int>(t / kApart_s + 0.5);
    const Vec3 rate = swings ? Vec3(view % 4 < 2 ? 0.15 : -0.15, view % 2 == 0 ? 0.2 : -0.2, 0) : Vec3::Zero();
    imu.push_back({Time{} + Duration::from_seconds(t), rate, Vec3(0, 0, 9.81)});
  }
  return imu;
}

/// `gain` of view i; a scene that moves as the camera does, and the bar, if it is there.
Evidence evidence(bool bar, bool moves, const std::function<double(int)>& gain) {
  const NoiseTexture scene(7, 30), paint(9, 20);
  Evidence out;
  out.rig = rig();
  out.imu = swinging(true);
  ViewSampler sampler;
  Image seen(kWidth, kHeight, 255);
  hide(seen, kBar);
  for (int i = 0; i < kViews; ++i) {
    const Vec2 at = moves ? where(i) : Vec2::Zero();
    const auto seed = static_cast<std::uint64_t>(i + 1);
    Image image = render_texture(
        kWidth, kHeight, scene, [&](const Vec2& p) { return Vec2(0.6 * (p + at)); }, gain(i) * 100, gain(i) * 35, 1.5, seed);
    const Image legs = render_texture(
        kWidth, kHeight, paint, [](const Vec2& p) { return Vec2(0.8 * p); }, gain(i) * 70, gain(i) * 40, 1.5, seed + 99);
    for (int y = 0; bar && y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        if (seen.at(x, y) == 0) image.at(x, y) = legs.at(x, y);
    Pyramid pyramid;
    pyramid.build(image.view(), 2);
    const Vec2 moved_px = i > 0 ? Vec2(where(i - 1) - where(i)) : Vec2::Zero();
    sampler.add(Time{} + Duration::from_seconds(kApart_s * (i + 0.5)), moved_px, pyramid, pyramid);
  }
  out.views = sampler.take();
  return out;
}

double agreement(const Mask& mask) {
  double both = 0, either = 0;
  Image seen(kWidth, kHeight, 255);
  hide(seen, kBar);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const bool found = mask.hides(Vec2(x, y)), there = seen.at(x, y) == 0;
      both += found && there;
      either += found || there;
    }
  return both / either;
}

constexpr auto kSteady = [](int) { return 1.0; };
const Evidence& with_bar() {
  static const Evidence seen = evidence(true, true, kSteady);
  return seen;
}

TEST(FixedView, FindsWhatStaysWhileTheSceneMoves) {
  const Evidence& seen = with_bar();
  const FixedInView fixed = find_fixed(seen, ImuSeries(seen.imu));
  ASSERT_TRUE(fixed.masks[0] && fixed.masks[1]);
  EXPECT_GT(agreement(*fixed.masks[0]), 0.8);
  EXPECT_NEAR(fixed.share[0], kBar.width * kBar.height / (kWidth * kHeight), 0.01);
}

TEST(FixedView, FindsItUnderChangingGain) {
  const Evidence seen = evidence(true, true, [](int view) { return 0.7 + 0.5 * (view % 3); });
  const FixedInView fixed = find_fixed(seen, ImuSeries(seen.imu));
  ASSERT_TRUE(fixed.masks[0]);
  EXPECT_GT(agreement(*fixed.masks[0]), 0.7);
}

TEST(FixedView, FindsNothingWhereNothingIsFixed) {
  const Evidence seen = evidence(false, true, kSteady);
  const FixedInView fixed = find_fixed(seen, ImuSeries(seen.imu));
  EXPECT_TRUE(fixed.judged());
  EXPECT_FALSE(fixed.any());
}

/// As under the ceiling of a room: brighter downwards in each view, by a little, while edges that are stronger cross it.
TEST(FixedView, EdgesOfTheSceneThatMeetAtAPixelAreNotFixed) {
  Evidence seen = evidence(false, true, kSteady);
  for (std::size_t i = 0; i < seen.views.size(); ++i) {
    auto wall = std::make_shared<Image>(kWidth / 2, kHeight / 2, 60);
    for (int y = 0; y < wall->height(); ++y)
      for (int x = 0; x < wall->width(); ++x) {
        const int stripe = (x + 7 * static_cast<int>(i)) / 3 % 5 == 0 ? 80 : 0;
        wall->at(x, y) = static_cast<std::uint8_t>(60 + stripe + 6 * std::clamp(y - 55, 0, 10));
      }
    seen.views[i].left = seen.views[i].right = wall;
  }
  EXPECT_TRUE(find_fixed(seen, ImuSeries(seen.imu)).judged());
  EXPECT_FALSE(find_fixed(seen, ImuSeries(seen.imu)).any());
}

TEST(FixedView, IsNotJudgedWhereTheReadingsShowNoTurn) {
  Evidence seen = with_bar();
  seen.imu = swinging(false);
  EXPECT_FALSE(find_fixed(seen, ImuSeries(seen.imu)).judged());
  for (ImuSample& sample : seen.imu) sample.gyro_radps = Vec3(0.06, -0.06, 0.04);  // a gyroscope's bias alone
  EXPECT_FALSE(find_fixed(seen, ImuSeries(seen.imu)).judged());
  seen.imu.clear();
  EXPECT_FALSE(find_fixed(seen, ImuSeries(seen.imu)).judged());
}

/// The motion is that of things that move, and the readings' turns are a shaking table's.
TEST(FixedView, AnImageThatStaysAsAWholeIsNotTheVehicle) {
  const Evidence seen = evidence(false, false, kSteady);
  EXPECT_FALSE(find_fixed(seen, ImuSeries(seen.imu)).any());
}

TEST(FixedView, WhatIsMaskedAlreadyIsNotFoundAgain) {
  Evidence seen = with_bar();
  Image drawn(kWidth, kHeight, 255);
  hide(drawn, kBar);
  seen.rig.cameras[0].camera.set_mask(std::make_shared<const Mask>(drawn));
  const FixedInView fixed = find_fixed(seen, ImuSeries(seen.imu));
  EXPECT_EQ(fixed.masks[0], nullptr);
  EXPECT_NE(fixed.masks[1], nullptr);
}

TEST(FixedView, TheSamplerKeepsViewsOfTheWholeRecording) {
  Pyramid pyramid;
  const Image image(64, 48, 100);
  pyramid.build(image.view(), 2);
  ViewSampler sampler;
  for (int i = 0; i < 1000; ++i) sampler.add(Time{} + Duration::from_seconds(i), Vec2(20, 0), pyramid, pyramid);
  const std::vector<SmallView> views = sampler.take();
  EXPECT_GE(views.size(), 48u);
  EXPECT_LE(views.size(), 96u);
  EXPECT_LT(views.front().t.ns, 20'000'000'000);
  EXPECT_GT(views.back().t.ns, 970'000'000'000);
  for (std::size_t i = 1; i < views.size(); ++i)
    EXPECT_NEAR(views[i].moved_px.x(), 20 * (views[i].t - views[i - 1].t).seconds(), 1e-6);
}

}  // namespace fixed_view_test
}  // namespace fbvins
