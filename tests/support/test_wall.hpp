// SPDX-License-Identifier: Apache-2.0
// For tests of the frontends' parts: a textured wall 3 m ahead of a camera that faces it and moves sideways.
#pragma once

#include "fbvins/frontend/orb_track.hpp"
#include "tests/support/noise_texture.hpp"

namespace fbvins {

struct TestWall {
  static constexpr int kWidth = 240, kHeight = 180;
  static constexpr double kFocal_px = 200, kDepth_m = 3;

  Camera camera{PinholeRadtan{.fx = kFocal_px, .fy = kFocal_px, .cx = 120, .cy = 90}, kWidth, kHeight};
  NoiseTexture texture{7, 24};

  StereoRig rig() const {
    StereoRig rig;
    rig.cameras.assign(2, {camera, {}});
    rig.cameras[1].T_BC = Pose<B, C0>(Quat::Identity(), Vec3(kBaseline_m, 0, 0));
    return rig;
  }
  static constexpr double kBaseline_m = 0.12;

  /// From `x_m` to the right of the origin.
  std::shared_ptr<const Image> render(double x_m, std::uint64_t noise_seed = 1) const {
    const auto warp = [&](const Vec2& px) { return Vec2(px.x() + kFocal_px / kDepth_m * x_m, px.y()); };
    return std::make_shared<const Image>(render_texture(kWidth, kHeight, texture, warp, 120, 35, 1.0, noise_seed));
  }
  /// Motion of the image, px, when the camera moves by x_m.
  static Vec2 shift(double x_m) { return {-kFocal_px / kDepth_m * x_m, 0}; }

  /// The motion of a camera that has gone to the right by x_m.
  static CameraMotion motion(double x_m) {
    CameraMotion motion;
    motion.has_rotation = motion.has_translation = true;
    motion.p_ba = Vec3(-x_m, 0, 0);
    return motion;
  }
};

}  // namespace fbvins
