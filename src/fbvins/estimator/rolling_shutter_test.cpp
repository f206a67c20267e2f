// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/rolling_shutter.hpp"

#include <gtest/gtest.h>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace {

RollingShutter shutter_with(double line_delay_s) {
  StereoRig rig;
  rig.left = rig.right = Camera(PinholeRadtan{.fx = 450, .fy = 450, .cx = 376, .cy = 240}, 752, 480);
  rig.line_delay_s = line_delay_s;
  return RollingShutter(rig);
}
constexpr double kLineDelay_s = 40e-6;
const RollingShutter kShutter = shutter_with(kLineDelay_s);

Calibration cameras() {
  Calibration c;
  c.T_BC0 = {so3_exp(Vec3(0.1, -0.2, 1.5)), Vec3(-0.02, -0.06, 0.01)};
  c.T_BC1 = {so3_exp(Vec3(0.11, -0.2, 1.49)), Vec3(-0.02, 0.05, 0.008)};
  return c;
}

/// The body at `s` seconds after the stamp, in the body at the stamp, with the motion's rate and acceleration.
Pose<B, B> body_at(const ShutterMotion& m, double s) { return {so3_exp(s * m.w_B + 0.5 * s * s * m.alpha_B), Vec3(s * m.v_B)}; }

Vec2 seen(const Pose<B, C0>& T_BC, const Vec3& p_B) {
  const Vec3 p_C = T_BC.inverse() * p_B;
  return p_C.head<2>() / p_C.z();
}

TrackedFeature at_rows(const ShutterMotion& m, const Vec3& p_stamp_B, double left_row, double right_row) {
  const auto observed = [&](const Pose<B, C0>& T_BC, double row) {
    Observation o;
    o.pixel = Vec2(300, row);
    o.normalised = seen(T_BC, body_at(m, (row - 240) * kLineDelay_s).inverse() * p_stamp_B);
    return o;
  };
  const Calibration c = cameras();
  TrackedFeature f;
  f.left = observed(c.T_BC0, left_row);
  f.right = observed(c.T_BC1.cast_frames<B, C0>(), right_row);
  return f;
}

TEST(RollingShutter, ObservationsOfAMovingBodyAreBroughtToTheStamp) {
  const ShutterMotion motion{Vec3(0.8, -1.5, 2), Vec3(5, 10, -15), Vec3(1, -2, 0.5)};
  const Calibration c = cameras();
  const Vec3 p_B = c.T_BC0 * Vec3(0.8, -0.9, 3);
  std::vector<TrackedFeature> features{at_rows(motion, p_B, 20, 40), at_rows(motion, p_B, 460, 430)};
  EXPECT_GT((features[0].left->normalised - seen(c.T_BC0, p_B)).norm(), 5e-3);
  const InverseDepth known = [&](const TrackedFeature&, bool right) {
    return std::optional(1 / ((right ? c.T_BC1.cast_frames<B, C0>() : c.T_BC0).inverse() * p_B).z());
  };
  kShutter.bring_to_stamp(motion, c, &known, features);
  for (const TrackedFeature& f : features) {
    // What is left: the depth at the row is not quite that at the stamp.
    EXPECT_LT((f.left->normalised - seen(c.T_BC0, p_B)).norm(), 4e-4);
    EXPECT_LT((f.right->normalised - seen(c.T_BC1.cast_frames<B, C0>(), p_B)).norm(), 4e-4);
  }
}

/// The camera in which depths are seen has the rows of the left one.
TEST(RollingShutter, DepthsAreBroughtToTheStamp) {
  StereoRig rig = with_depth({}, {});
  rig.left = Camera(PinholeRadtan{.fx = 450, .fy = 450, .cx = 376, .cy = 240}, 752, 480);
  rig.line_delay_s = kLineDelay_s;
  const RollingShutter shutter(rig);
  const Calibration c{rig.T_BC0, rig.T_BC1, 0.0};
  const ShutterMotion motion{Vec3(0.8, -1.5, 2), Vec3::Zero(), Vec3(0, 0, 1)};
  const double after_s = (460 - 240) * kLineDelay_s;
  const Vec3 p_B(0.8, -0.9, 3), at_row_B = body_at(motion, after_s).inverse() * p_B;
  TrackedFeature f;
  f.left = Observation{Vec2(300, 460), at_row_B.head<2>() / at_row_B.z(), Mat2::Identity()};
  f.right = Observation{Vec2(300, 460), f.left->normalised - Vec2(kDepthBaseline_m / at_row_B.z(), 0), Mat2::Identity()};
  std::vector<TrackedFeature> features{f};
  shutter.bring_to_stamp(motion, c, nullptr, features);
  EXPECT_LT((features[0].left->normalised - p_B.head<2>() / p_B.z()).norm(), 1e-4);
  EXPECT_NEAR(kDepthBaseline_m / (features[0].left->normalised - features[0].right->normalised).x(), 3, 0.001);
}

TEST(RollingShutter, ATurnNeedsNoDepth) {
  const ShutterMotion motion{Vec3(0.8, -1.5, 2), Vec3::Zero(), Vec3::Zero()};
  const Calibration c = cameras();
  const Vec3 far_B = c.T_BC0 * Vec3(80, -90, 3000);
  std::vector<TrackedFeature> features{at_rows(motion, far_B, 20, 470)};
  features[0].right.reset();
  kShutter.bring_to_stamp(motion, c, nullptr, features);
  EXPECT_LT((features[0].left->normalised - seen(c.T_BC0, far_B)).norm(), 1e-6);
}

TEST(RollingShutter, AGlobalShutterChangesNoBit) {
  const ShutterMotion motion{Vec3(0.8, -1.5, 2), Vec3(5, 10, -15), Vec3(1, -2, 0.5)};
  std::vector<TrackedFeature> features{at_rows(motion, cameras().T_BC0 * Vec3(0.8, -0.9, 3), 20, 40)};
  const Vec2 before = features[0].left->normalised;
  shutter_with(0).bring_to_stamp(motion, cameras(), nullptr, features);
  EXPECT_EQ(features[0].left->normalised, before);
}

TEST(RollingShutter, TheTurningAtTheEndIsExtrapolatedFromTheLastReadings) {
  ImuSegment readings;
  for (int i = 0; i <= 10; ++i) {
    const double s = 0.005 * (i - 10);
    readings.samples.push_back({Time{1'000'000'000 + (i - 10) * 5'000'000}, Vec3(1 + 20 * s, 2, -30 * s), Vec3::Zero()});
  }
  const ShutterMotion m = turning_at_end(readings, Vec3(0.1, 0, 0));
  EXPECT_LT((m.w_B - Vec3(0.9, 2, 0)).norm(), 1e-9);
  EXPECT_LT((m.alpha_B - Vec3(20, 0, -30)).norm(), 1e-6);
  EXPECT_EQ(turning_at_end({}, Vec3::Zero()).w_B, Vec3::Zero());
}

}  // namespace
}  // namespace fbvins
