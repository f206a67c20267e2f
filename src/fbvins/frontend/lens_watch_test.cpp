// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/lens_watch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fbvins/features/noise_texture.hpp"

namespace fbvins {
namespace lens_watch_test {

constexpr int kWidth = 320, kHeight = 240;
constexpr double kFocal_px = 250, kPeriod_s = 0.05;
constexpr struct { int x, y, width, height; } kSpot{150, 80, 60, 50};
constexpr double kSpotShare = kSpot.width * kSpot.height / (1.0 * kWidth * kHeight);
constexpr int kMargin_px = 80;  // of the panorama around an image

StereoRig rig() {
  StereoRig rig;
  rig.left = rig.right = Camera(PinholeRadtan{kFocal_px, kFocal_px, 160, 120, 0, 0, 0, 0}, kWidth, kHeight);
  rig.T_BC1.p = Vec3(0.1, 0, 0);
  return rig;
}

const Image& panorama() {
  static const Image all = render_texture(
      kWidth + 2 * kMargin_px, kHeight + 2 * kMargin_px, NoiseTexture(7, 30), [](const Vec2& p) { return Vec2(0.6 * p); }, 100,
      35, 1.5, 1);
  return all;
}

/// A rig that looks far away and swings about two axes, by angles that the scene's motion in the image follows from.
struct Flight {
  explicit Flight(StereoRig of = rig()) : watch(of) {}

  Vec3 angle(double at_s) const { return swing_rad * Vec3(std::cos(1.3 * at_s), std::sin(1.7 * at_s), 0); }
  Vec2 shift_px(double at_s) const { return kFocal_px * Vec2(-angle(at_s).y(), angle(at_s).x()); }

  std::shared_ptr<const Image> image(double at_s, bool spot) const {
    const Vec2 from = kMargin_px * Vec2::Ones() - shift_px(at_s);
    const int left = static_cast<int>(std::lround(from.x())), top = static_cast<int>(std::lround(from.y()));
    Image out(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) std::copy_n(panorama().row(top + y) + left, kWidth, out.row(y));
    for (int y = kSpot.y; spot && y < kSpot.y + kSpot.height; ++y)
      for (int x = kSpot.x; x < kSpot.x + kSpot.width; ++x) out.at(x, y) = static_cast<std::uint8_t>(40 + out.at(x, y) / 8);
    return std::make_shared<const Image>(out);
  }

  /// Flies on, with a spot on the right camera's lens or without.
  void fly(double seconds, bool spot) {
    for (const double end_s = t_s + seconds; t_s < end_s; t_s += kPeriod_s) {
      SensorPacket packet;
      packet.frame = {Time{} + Duration::from_seconds(t_s), image(t_s, false), image(t_s, spot)};
      for (int i = 0; i <= 10; ++i) {
        const double at_s = t_s - kPeriod_s + 0.1 * kPeriod_s * i;
        packet.imu.samples.push_back({Time{} + Duration::from_seconds(at_s), bias_radps + rate(at_s), Vec3(0, 0, 9.81)});
      }
      TrackedFrame tracked;
      tracked.t = packet.frame.t;
      for (int i = 0; i < 40; ++i) {
        TrackedFeature feature;
        feature.id = TrackId{i};
        const Vec2 px = Vec2(20 + 7 * i, 30 + 4 * i) + shift_px(t_s);
        feature.left = feature.right = Observation{.pixel = px};
        tracked.features.push_back(feature);
      }
      StatePrior prior;
      prior.valid = estimated;
      prior.bias.gyro_radps = bias_radps;
      watch.add(packet, prior, tracked);
    }
  }
  Vec3 rate(double at_s) const { return (angle(at_s + 1e-4) - angle(at_s - 1e-4)) / 2e-4; }

  LensWatch watch;
  Vec3 bias_radps = Vec3(0.03, -0.02, 0.01);
  double swing_rad = 0.3, t_s = 0;
  bool estimated = true;
};

double share(int px) { return px / (1.0 * kWidth * kHeight); }

TEST(LensWatch, FindsASpotThatComesInFlightAndItsEnd) {
  Flight flight;
  flight.fly(12, false);
  EXPECT_EQ(flight.watch.covered_px(0) + flight.watch.covered_px(1), 0);
  EXPECT_EQ(flight.watch.rig().right.mask(), nullptr);
  flight.fly(12, true);
  EXPECT_EQ(flight.watch.covered_px(0), 0);
  EXPECT_NEAR(share(flight.watch.covered_px(1)), kSpotShare, 0.5 * kSpotShare);
  const Camera right = flight.watch.rig().right;  // a copy, as the frontends have
  EXPECT_TRUE(right.hidden({180, 105}, 0));
  EXPECT_FALSE(right.hidden({60, 60}, 0));
  flight.fly(12, false);
  EXPECT_EQ(flight.watch.covered_px(1), 0);
  EXPECT_FALSE(right.hidden({180, 105}, 0));
}

TEST(LensWatch, SaysNothingWhereTheRigDoesNotTurn) {
  Flight flight;
  flight.swing_rad = 0.01;
  flight.fly(20, true);
  EXPECT_EQ(flight.watch.covered_px(1), 0);
}

TEST(LensWatch, SaysNothingBeforeTheGyroscopesBiasIsKnown) {
  Flight flight;
  flight.estimated = false;
  flight.fly(20, true);
  EXPECT_EQ(flight.watch.covered_px(1), 0);
}

TEST(LensWatch, KeepsWhatTheCalibrationMasks) {
  StereoRig masked = rig();
  Image seen(kWidth, kHeight, 255);
  hide(seen, MaskRectangle{0, 200, 320, 40});
  masked.right.set_mask(std::make_shared<const Mask>(seen));
  Flight flight(masked);
  flight.fly(15, true);
  EXPECT_GT(flight.watch.covered_px(1), 0);
  EXPECT_TRUE(flight.watch.rig().right.hidden({100, 220}, 0));
  EXPECT_TRUE(flight.watch.rig().right.hidden({180, 105}, 0));
  EXPECT_EQ(masked.right.mask()->hidden_share(), 40.0 / kHeight);
}

}  // namespace lens_watch_test
}  // namespace fbvins
