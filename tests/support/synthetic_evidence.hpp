// SPDX-License-Identifier: Apache-2.0
// For tests: the evidence of a good recording, without images: features of a room of points, seen by a rig on a motion known in
// closed form.
#pragma once

#include "fbvins/core/rng.hpp"
#include "fbvins/doctor/evidence.hpp"
#include "tests/support/imu_test_motion.hpp"

namespace fbvins::test {

struct SyntheticSetup {
  double seconds = 14;
  double late_s = 0;        ///< delay of the readings' stamps
  double right_late_s = 0;  ///< delay of the right images' exposure
  double rolling_s = 0;     ///< from an image's first line to its last
  double pixel_sigma_px = 0.15;
};

/// EuRoC's kind of rig: 90 degrees wide, 11 cm, the camera's x along the body's -y.
inline StereoRig synthetic_rig() {
  StereoRig rig;
  rig.cameras.resize(2);
  rig.cameras[0].camera = Camera(PinholeRadtan{.fx = 458, .fy = 457, .cx = 367, .cy = 248, .k1 = -0.28, .k2 = 0.07}, 752, 480);
  rig.cameras[1].camera = Camera(PinholeRadtan{.fx = 457, .fy = 456, .cx = 379, .cy = 255, .k1 = -0.28, .k2 = 0.07}, 752, 480);
  const Mat3 R_BC = (Mat3() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished() * so3_exp(Vec3(0.02, -0.01, 0.03)).toRotationMatrix();
  rig.cameras[0].T_BC = {R_BC, Vec3(0.02, 0.055, 0.01)};
  rig.cameras[1].T_BC = {Mat3(R_BC * so3_exp(Vec3(0.01, 0.005, -0.004)).toRotationMatrix()), Vec3(0.02, -0.055, 0.012)};
  return rig;
}

class SyntheticEvidence {
 public:
  explicit SyntheticEvidence(const SyntheticSetup& setup) : setup_(setup), rig_(synthetic_rig()) {
    for (int i = 0; i < 700; ++i) {  // on the walls of a room of 8 x 8 x 4 m
      Vec3 p(rng_.uniform(-4, 4), 0, 0);
      p.y() = rng_.uniform(-4, 4), p.z() = rng_.uniform(-2, 2);
      const int axis = static_cast<int>(rng_.below(3));
      p(axis) = (axis == 2 ? 2 : 4) * (rng_.below(2) != 0 ? 1 : -1);
      points_.push_back(p);
    }
  }

  Evidence make() {
    Evidence evidence;
    evidence.rig = evidence.working_rig = rig_;
    for (Time t{500'000'000}; t.seconds() < setup_.seconds + 1.5; t = t + Duration{5'000'000}) {
      ImuSample sample = motion_.sample(t, {Vec3(0.01, -0.02, 0.03), Vec3(0.05, 0.1, -0.08)});
      sample.t = t + Duration::from_seconds(setup_.late_s);
      for (int i = 0; i < 3; ++i) sample.gyro_radps(i) += 0.003 * rng_.normal(), sample.accel_mps2(i) += 0.03 * rng_.normal();
      evidence.imu.push_back(sample);
    }
    for (Time t{1'000'000'000}; t.seconds() < setup_.seconds + 1; t = t + Duration{100'000'000}) add_frame(t, evidence);
    return evidence;
  }

 private:
  Vec2 noisy(const Vec2& px) {
    const double x = rng_.normal(), y = rng_.normal();
    return px + setup_.pixel_sigma_px * Vec2(x, y);
  }
  template <class Cam>
  std::optional<Vec2> seen(const Vec3& p_W, const Camera& camera, const Pose<B, Cam>& T_BC, double t) const {
    double at = t;
    std::optional<Vec2> px;
    for (int i = 0; i < 3; ++i) {  // each line at its own time
      const Vec3 p_C = T_BC.inverse() * (motion_.state(at).T_FB.inverse() * p_W);
      if (p_C.z() < 0.3) return std::nullopt;
      px = camera.project(p_C);
      if (!px || !camera.inside(*px, 4)) return std::nullopt;
      at = t + setup_.rolling_s * (px->y() / camera.height() - 0.5);
    }
    return px;
  }
  void add_frame(Time t, Evidence& evidence) {
    SeenFrame frame;
    StereoView view{t, {}};
    frame.t = t;
    frame.has_depths = true;
    const auto T_C0W = rig_.T_BC0().inverse() * motion_.state(t.seconds()).T_FB.inverse();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const auto left = seen(points_[i], rig_.left(), rig_.T_BC0(), t.seconds());
      const auto right = seen(points_[i], rig_.right(), rig_.T_BC1(), t.seconds() + setup_.right_late_s);
      if (!left || !right) continue;
      const double disparity = rig_.left().focal_px() * 0.11 / (T_C0W * points_[i]).z();
      const double inverse_depth = (disparity + 0.2 * rng_.normal()) / (rig_.left().focal_px() * 0.11);
      frame.features.push_back({static_cast<std::int64_t>(i), noisy(*left), std::max(inverse_depth, 1e-3), false});
      view.points.push_back({noisy(*left), noisy(*right)});
    }
    evidence.stamps.push_back(t);
    evidence.frames.push_back(std::move(frame));
    evidence.stereo.push_back(std::move(view));
    ++evidence.repeated.frames;
  }

  SyntheticSetup setup_;
  StereoRig rig_;
  Motion motion_{0.35, 0.25};
  Rng rng_{3};
  std::vector<Vec3> points_;
};

}  // namespace fbvins::test
