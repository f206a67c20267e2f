// SPDX-License-Identifier: Apache-2.0
// For tests of whole frontends: a rig that flies past a textured wall and turns, as packets.
#pragma once

#include <vector>

#include "fbvins/frontend/frontend.hpp"
#include "fbvins/frontend/orb_options.hpp"
#include "tests/support/noise_texture.hpp"

namespace fbvins::textured_wall {

inline constexpr int kWidth = 376, kHeight = 240;
inline constexpr double kDepth_m = 3.0, kSpeed_mps = 0.4, kFramePeriod_s = 0.05;

inline StereoRig make_rig() {
  StereoRig rig;
  PinholeRadtan model;
  model.fx = model.fy = 230;
  model.cx = 187.5, model.cy = 119.5;
  model.k1 = -0.05;
  rig.cameras.assign(2, {Camera(model, kWidth, kHeight), {}});
  rig.cameras[1].T_BC = Pose<B, C0>(Quat::Identity(), Vec3(0.11, 0, 0));
  return rig;
}

/// A textured wall 3 m ahead; the body moves along x and turns about z, with exact readings.
class World {
 public:
  Vec3 position(int k) const { return {kSpeed_mps * kFramePeriod_s * k, 0.02 * k * kFramePeriod_s, 0}; }
  double angle(int k) const { return 0.2 * kFramePeriod_s * k; }

  std::shared_ptr<const Image> render(int k, double offset_x, std::uint64_t noise_seed) const {
    const Camera& camera = offset_x > 0 ? rig.right() : rig.left();
    const Eigen::Rotation2Dd R(angle(k));
    const Vec2 centre = position(k).head<2>() + R * Vec2(offset_x, 0);
    const auto warp = [&](const Vec2& px) { return Vec2((centre + R * (*camera.undistort(px) * kDepth_m)) * 230 / kDepth_m); };
    return std::make_shared<const Image>(render_texture(kWidth, kHeight, texture, warp, 120, 35, 1.0, noise_seed));
  }

  SensorPacket packet(int k) const {
    SensorPacket p = packet_without_images(k);
    p.frame.set_image(0, render(k, 0, static_cast<std::uint64_t>(2 * k)));
    p.frame.set_image(1, render(k, 0.11, static_cast<std::uint64_t>(2 * k + 1)));
    return p;
  }

  SensorPacket packet_without_images(int k) const {
    SensorPacket p;
    p.id = FrameId{k};
    p.frame.t = Time{static_cast<std::int64_t>(k * kFramePeriod_s * 1e9)};
    for (int i = 0; k > 0 && i <= 10; ++i)
      p.imu.samples.push_back({Time{p.frame.t.ns - 50'000'000 + 5'000'000 * i}, Vec3(0, 0, 0.2), Vec3(0, 0, 9.81)});
    return p;
  }

  /// Where a point of the wall is seen in the left image of frame k, from normalised coordinates there.
  Vec2 wall_point(int k, const Vec2& normalised) const {
    return position(k).head<2>() + Eigen::Rotation2Dd(angle(k)) * Vec2(normalised * kDepth_m);
  }

  explicit World(const StereoRig& seen_by = make_rig()) : rig(seen_by) {}
  StereoRig rig;

 private:
  NoiseTexture texture{11, 30};
};

inline const World& world() {
  static const World w;
  return w;
}

inline const std::vector<SensorPacket>& packets() {
  static const std::vector<SensorPacket> all = [] {
    std::vector<SensorPacket> p;
    for (int k = 0; k < 10; ++k) p.push_back(world().packet(k));
    return p;
  }();
  return all;
}

inline OrbFrontendOptions small_options() {
  OrbFrontendOptions options;
  options.max_features = 80;
  options.max_keypoints = 250;
  return options;
}

}  // namespace fbvins::textured_wall
