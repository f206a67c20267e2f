// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/klt_frontend.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "tests/support/noise_texture.hpp"

namespace fbvins {
namespace klt_frontend_test {

/// A stereo camera that flies past a textured wall at z = 3 m of G, looking at it and turning a little.
class Wall {
 public:
  Wall() {
    rig.cameras.resize(2);
    rig.cameras[0].camera = Camera(PinholeRadtan{230, 229, 160, 118, -0.28, 0.07, 2e-4, 2e-5}, 320, 240);
    rig.cameras[1].camera = Camera(PinholeRadtan{229, 230, 162, 121, -0.27, 0.07, -1e-4, 3e-5}, 320, 240);
    rig.cameras[0].T_BC = Pose<B, C0>(so3_exp(Vec3(0.01, -0.02, 0.3)), Vec3(0.02, -0.01, 0.03));
    const Pose<C0, C1> T_C0C1(so3_exp(Vec3(0.004, -0.006, 0.003)), Vec3(0.11, 0.001, -0.002));
    rig.cameras[1].T_BC = (rig.T_BC0() * T_C0C1).cast_frames<B, C0>();
  }

  static double time_s(int k) { return 0.05 * k; }
  Pose<G, C0> T_GC0(double s) const {
    return {so3_exp(Vec3(0.1 * std::sin(2 * s), -0.3 * s, 0.2 * s)), Vec3(0.5 * s, 0.1 * s * s, 0.3 * s)};
  }
  Pose<G, B> T_GB(double s) const { return T_GC0(s) * rig.T_BC0().inverse(); }

  /// Where the ray of a left pixel's normalised coordinates meets the wall.
  template <class C>
  static Vec3 on_wall(const Pose<G, C>& T_GC, const Vec2& normalised) {
    const Vec3 ray = T_GC.q * normalised.homogeneous();
    return T_GC.p + (3.0 - T_GC.p.z()) / ray.z() * ray;
  }

  static Vec2 on_texture(const Vec3& p_G) { return 70.0 * p_G.head<2>(); }  // 70 texels a metre

  template <class C>
  std::shared_ptr<const Image> render(const Camera& camera, const Pose<G, C>& T_GC, double gain) const {
    auto image = std::make_shared<Image>(camera.width(), camera.height());
    const auto warp = [&](const Vec2& px) { return on_texture(on_wall(T_GC, camera.undistort(px).value())); };
    *image = render_texture(camera.width(), camera.height(), texture_, warp, gain * 100, gain * 30, 0.7,
                            static_cast<std::uint64_t>(1e6 * gain));
    return image;
  }

  SensorPacket packet(int k, double gain = 1) const {
    SensorPacket packet;
    packet.id = FrameId{k};
    packet.frame.t = Time{} + Duration::from_seconds(time_s(k));
    packet.frame.set_image(0, render(rig.left(), T_GC0(time_s(k)), gain));
    packet.frame.set_image(1, render(rig.right(), T_GC0(time_s(k)) * rig.T_BC0().inverse() * rig.T_BC1(), 1.2 * gain));
    if (k > 0) packet.imu = imu(time_s(k - 1), time_s(k));
    return packet;
  }

  ImuSegment imu(double from_s, double to_s) const {
    ImuSegment segment;
    for (double s = from_s; s < to_s + 1e-6; s += 0.005) {
      ImuSample sample;
      sample.t = Time{} + Duration::from_seconds(s);
      const double h = 1e-4;
      sample.gyro_radps = so3_log(T_GB(s - h).q.conjugate() * T_GB(s + h).q) / (2 * h);
      const Vec3 a_G = (T_GB(s + h).p - 2 * T_GB(s).p + T_GB(s - h).p) / (h * h);
      sample.accel_mps2 = T_GB(s).q.conjugate() * (a_G + Vec3(0, 0, 9.81));
      segment.samples.push_back(sample);
    }
    return segment;
  }

  StatePrior prior(int k) const {
    StatePrior prior;
    prior.t = Time{} + Duration::from_seconds(time_s(k));
    prior.T_GB = T_GB(time_s(k));
    const double h = 1e-4;
    prior.v_GB = (T_GB(time_s(k) + h).p - T_GB(time_s(k) - h).p) / (2 * h);
    prior.valid = true;
    return prior;
  }

  StereoRig rig;

 private:
  NoiseTexture texture_{21, 24};
};

KltFrontendOptions small_options() {
  KltFrontendOptions options;
  options.max_features = 60;
  options.min_distance_px = 16;
  return options;
}

/// Errors in px of every left observation against the wall point of the track's first one, and of
/// every right observation against that of the same frame's left one.
struct Errors {
  std::map<TrackId, Vec3> points;
  std::vector<double> left, right;

  void add(const Wall& wall, const TrackedFrame& frame) {
    const double s = frame.t.seconds();
    const Pose<G, C0> T_GC0 = wall.T_GC0(s);
    const Pose<G, C1> T_GC1 = wall.T_GB(s) * wall.rig.T_BC1();
    for (const TrackedFeature& feature : frame.features) {
      const Vec3 here = Wall::on_wall(T_GC0, feature.left()->normalised);
      const Vec3& first = points.emplace(feature.id, here).first->second;
      if (feature.age_frames > 0)
        left.push_back((wall.rig.left().project(T_GC0.inverse() * first).value() - feature.left()->pixel).norm());
      if (feature.right())
        right.push_back((wall.rig.right().project(T_GC1.inverse() * here).value() - feature.right()->pixel).norm());
    }
  }
  static double quantile(std::vector<double> v, double q) {
    std::sort(v.begin(), v.end());
    return v.empty() ? 1e9 : v[static_cast<std::size_t>(q * static_cast<double>(v.size() - 1))];
  }
};

TEST(KltFrontend, FollowsAWallInBothCamerasBelowATenthOfAPixel) {
  const Wall wall;
  std::vector<SensorPacket> packets;
  for (int k = 0; k < 10; ++k) packets.push_back(wall.packet(k));
  for (const bool with_prior : {true, false}) {
    KltFrontend frontend(wall.rig, small_options());
    Errors errors;
    for (int k = 0; k < 10; ++k) {
      const TrackedFrame out =
          frontend.process(packets[static_cast<std::size_t>(k)], with_prior && k > 0 ? wall.prior(k - 1) : StatePrior{});
      errors.add(wall, out);
      EXPECT_GE(out.features.size(), 40u) << k;
      EXPECT_GE(out.stats.stereo, 30) << k;
      if (k > 0) {
        EXPECT_GE(out.stats.tracked, 35) << k;
        EXPECT_GT(out.stats.median_motion_px, 1.0) << k;
      }
    }
    EXPECT_LT(Errors::quantile(errors.left, 0.5), 0.1);
    EXPECT_LT(Errors::quantile(errors.left, 0.95), 0.4);
    EXPECT_LT(Errors::quantile(errors.right, 0.5), 0.1);
    EXPECT_LT(Errors::quantile(errors.right, 0.95), 0.4);
  }
}

TEST(KltFrontend, ObservationsAreConsistentWithTheCamera) {
  const Wall wall;
  KltFrontendOptions options = small_options();
  options.sigma_px = 0.5;
  KltFrontend frontend(wall.rig, options);
  const TrackedFrame out = frontend.process(wall.packet(0), StatePrior{});
  ASSERT_FALSE(out.features.empty());
  for (const TrackedFeature& feature : out.features) {
    EXPECT_LT((wall.rig.left().distort(feature.left()->normalised) - feature.left()->pixel).norm(), 1e-6);
    const Vec2 d(1e-5, -2e-5);
    const Vec2 moved = (wall.rig.left().distort(feature.left()->normalised + d) - feature.left()->pixel) / 0.5;
    EXPECT_LT((feature.left()->sqrt_information * d - moved).norm(), 1e-2 * moved.norm());
    EXPECT_EQ(feature.age_frames, 0);
  }
}

TEST(KltFrontend, SurvivesATenfoldExposureJump) {
  const Wall wall;
  KltFrontend frontend(wall.rig, small_options());
  frontend.process(wall.packet(0, 0.12), StatePrior{});
  const TrackedFrame before = frontend.process(wall.packet(1, 0.12), StatePrior{});
  const TrackedFrame after = frontend.process(wall.packet(2, 1.2), StatePrior{});
  EXPECT_GE(after.stats.tracked, static_cast<int>(0.8 * static_cast<double>(before.features.size())));
}

TEST(KltFrontend, BlackImagesLoseFeaturesAndLightBringsThemBack) {
  const Wall wall;
  KltFrontend frontend(wall.rig, small_options());
  const TrackedFrame first = frontend.process(wall.packet(0), StatePrior{});
  SensorPacket dark = wall.packet(1);
  dark.frame.set_image(0, std::make_shared<Image>(320, 240));
  dark.frame.set_image(1, std::make_shared<Image>(320, 240));
  const TrackedFrame black = frontend.process(dark, StatePrior{});
  EXPECT_TRUE(black.features.empty());
  EXPECT_EQ(black.stats.mean_brightness_left, 0);
  const TrackedFrame again = frontend.process(wall.packet(2), StatePrior{});
  EXPECT_GE(again.features.size(), 40u);
}

TEST(KltFrontend, AMissingLeftImageIsBridgedAndAMissingRightOneCostsOnlyStereo) {
  const Wall wall;
  KltFrontend frontend(wall.rig, small_options());
  frontend.process(wall.packet(0), StatePrior{});
  SensorPacket no_right = wall.packet(1);
  no_right.frame.set_image(1, nullptr);
  const TrackedFrame left_only = frontend.process(no_right, wall.prior(0));
  EXPECT_GE(left_only.stats.tracked, 35);
  EXPECT_EQ(left_only.stats.stereo, 0);
  SensorPacket blind = wall.packet(2);
  blind.frame.set_image(0, nullptr);
  EXPECT_TRUE(frontend.process(blind, wall.prior(1)).features.empty());
  const TrackedFrame back = frontend.process(wall.packet(3), wall.prior(1));
  EXPECT_GE(back.stats.tracked, 25);
  EXPECT_GE(back.stats.stereo, 30);
}

TEST(KltFrontend, StartsAnewAfterALongGapOrAStepBackInTime) {
  const Wall wall;
  KltFrontend frontend(wall.rig, small_options());
  const TrackedFrame first = frontend.process(wall.packet(0), StatePrior{});
  SensorPacket late = wall.packet(1);
  late.frame.t = late.frame.t + Duration::from_seconds(2);
  late.imu = {};
  const TrackedFrame after = frontend.process(late, StatePrior{});
  EXPECT_EQ(after.stats.tracked, 0);
  EXPECT_GE(after.features.size(), 40u);
  for (const TrackedFeature& feature : after.features) EXPECT_GT(feature.id, first.features.back().id);
  EXPECT_EQ(frontend.process(wall.packet(2), StatePrior{}).stats.tracked, 0);
}

TEST(KltFrontend, ImagesOfAnotherSizeAreNotUsed) {
  const Wall wall;
  KltFrontend frontend(wall.rig, small_options());
  frontend.process(wall.packet(0), StatePrior{});
  SensorPacket odd = wall.packet(1);
  odd.frame.set_image(0, std::make_shared<Image>(160, 120, std::uint8_t{90}));
  odd.frame.set_image(1, std::make_shared<Image>(7, 3, std::uint8_t{90}));
  EXPECT_TRUE(frontend.process(odd, StatePrior{}).features.empty());
  EXPECT_GE(frontend.process(wall.packet(2), StatePrior{}).features.size(), 40u);
}

TEST(KltFrontend, SameInputSameBits) {
  const Wall wall;
  KltFrontend a(wall.rig, small_options()), b(wall.rig, small_options());
  for (int k = 0; k < 4; ++k) {
    const SensorPacket packet = wall.packet(k);
    const TrackedFrame x = a.process(packet, StatePrior{}), y = b.process(packet, StatePrior{});
    ASSERT_EQ(x.features.size(), y.features.size());
    for (std::size_t i = 0; i < x.features.size(); ++i) {
      EXPECT_EQ(x.features[i].id, y.features[i].id);
      EXPECT_EQ(x.features[i].left()->pixel, y.features[i].left()->pixel);
      EXPECT_EQ(x.features[i].by_several(), y.features[i].by_several());
    }
  }
}

TEST(KltFrontend, HasNoFeatureInTheMask) {
  Wall wall;
  Image left(320, 240, 255), right(320, 240, 255);
  hide(left, MaskRectangle{0, 150, 320, 90});
  hide(right, MaskCircle{160, 90, 40});
  wall.rig.cameras[0].camera.set_mask(std::make_shared<const Mask>(left));
  wall.rig.cameras[1].camera.set_mask(std::make_shared<const Mask>(right));
  KltFrontend frontend(wall.rig, small_options());
  int in_right = 0;
  for (int k = 0; k < 10; ++k) {
    const TrackedFrame out = frontend.process(wall.packet(k), k > 0 ? wall.prior(k - 1) : StatePrior{});
    EXPECT_GE(out.features.size(), 25u) << k;
    for (const TrackedFeature& feature : out.features) {
      EXPECT_FALSE(wall.rig.left().hidden(feature.left()->pixel, kPatchBorder_px));
      if (!feature.right()) continue;
      EXPECT_FALSE(wall.rig.right().hidden(feature.right()->pixel, kPatchBorder_px));
      ++in_right;
    }
  }
  EXPECT_GT(in_right, 100);
}

}  // namespace klt_frontend_test
}  // namespace fbvins
