// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/exposures.hpp"

#include <gtest/gtest.h>

#include "fbvins/camera/camera_times.hpp"
#include "fbvins/camera/depth_reader.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace exposures_test {

constexpr double kLineDelay_s = 40e-6;
const Vec3 kGravity_B(0.3, -0.2, -9.8);

StereoRig cameras(double line_delay_s) {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{.fx = 450, .fy = 450, .cx = 376, .cy = 240}, 752, 480), {}});
  rig.cameras[0].T_BC = {so3_exp(Vec3(0.1, -0.2, 1.5)), Vec3(-0.02, -0.06, 0.01)};
  rig.cameras[1].T_BC = {so3_exp(Vec3(0.11, -0.2, 1.49)), Vec3(-0.02, 0.05, 0.008)};
  rig.line_delay_s = line_delay_s;
  return rig;
}

/// A body whose rate changes evenly and whose acceleration is constant, in B at the stamp.
struct Motion {
  Vec3 w = Vec3(0.8, -1.5, 2), slope = Vec3(5, 10, -15), v = Vec3(1, -2, 0.5), a = Vec3(3, 1, -2);

  Vec3 rate(double s) const { return w + s * slope; }
  Quat turn(double s) const {
    Quat q = Quat::Identity();
    const int steps = 2000;
    for (int i = 0; i < steps; ++i) q = q * so3_exp(s / steps * rate((i + 0.5) * s / steps));
    return q;
  }
  Pose<B, B> body(double s) const { return {turn(s), Vec3(s * v + 0.5 * s * s * a)}; }
  /// 50 ms at 200 Hz, up to the stamp.
  ImuSegment readings(const ImuBias& bias) const {
    ImuSegment out;
    for (int i = -10; i <= 0; ++i) {
      const Vec3 f_B = turn(0.005 * i).conjugate() * (a - kGravity_B);
      out.samples.push_back({Time{1'000'000'000 + i * 5'000'000}, rate(0.005 * i) + bias.gyro_radps, f_B + bias.accel_mps2});
    }
    return out;
  }
};
const ImuBias kBias{Vec3(0.02, -0.03, 0.01), Vec3(0.1, 0.05, -0.08)};

Vec2 seen(const Pose<B, C0>& T_BC, const Vec3& p_B) { return (T_BC.inverse() * p_B).hnormalized(); }

/// What an observation says of a point, from where the camera was: zero where it is right.
double error(const Observation& o, const Pose<B, C0>& T_BC, const Vec3& v_B, const Vec3& p_B) {
  const Pose<B, C0> displaced{T_BC.q, Vec3(T_BC.p + o.displacement_B(v_B))};
  return (o.normalised - seen(displaced, p_B)).norm();
}

/// A point of the body at the stamp, seen in one row of each camera, at its offset.
TrackedFrame frame_of(const StereoRig& rig, const Motion& m, const Vec3& p_B, double left_row, double right_row,
                      const ExposureOffsets& offsets) {
  const auto observed = [&](int camera, double row) {
    Observation o;
    o.pixel = Vec2(300, row);
    const double after_s = offsets.of(camera).seconds() + (row - 240) * rig.times(camera).line_delay_s;
    o.normalised = seen(rig.T_BC(camera), m.body(after_s).inverse() * p_B);
    return o;
  };
  TrackedFrame frame;
  frame.offsets = offsets;
  frame.features.resize(1);
  frame.features[0].see(0, observed(0, left_row));
  frame.features[0].see(1, observed(1, right_row));
  return frame;
}

struct Case {
  double line_delay_s, left_row, right_row;
  ExposureOffsets offsets;
  double left, right;  ///< largest errors, normalised
};

class ReferredToStamp : public testing::TestWithParam<Case> {};

TEST_P(ReferredToStamp, ObservationsOfAMovingBodyAreThoseOfDisplacedCameras) {
  const Case& c = GetParam();
  const StereoRig rig = cameras(c.line_delay_s);
  const Motion m;
  const Vec3 p_B = rig.T_BC0() * Vec3(0.4, -0.5, 2);
  TrackedFrame frame = frame_of(rig, m, p_B, c.left_row, c.right_row, c.offsets);
  EXPECT_GT(error(*frame.features[0].left(), rig.T_BC(0), m.v, p_B) + error(*frame.features[0].right(), rig.T_BC(1), m.v, p_B),
            4e-3);
  Exposures(rig).refer_to_stamp(ExposureMotion(m.readings(kBias), kBias, kGravity_B), {{rig.T_BC(0), rig.T_BC(1)}}, frame);
  EXPECT_LT(error(*frame.features[0].left(), rig.T_BC(0), m.v, p_B), c.left);
  EXPECT_LT(error(*frame.features[0].right(), rig.T_BC(1), m.v, p_B), c.right);
}

INSTANTIATE_TEST_SUITE_P(All, ReferredToStamp,
                         testing::Values(Case{kLineDelay_s, 20, 40, {}, 1e-4, 1e-4},    // upper rows, before the stamp
                                         Case{kLineDelay_s, 460, 430, {}, 1e-4, 1e-4},  // lower ones, extrapolated
                                         Case{0, 200, 200, ExposureOffsets({{}, Duration{-25'000'000}}), 1e-12, 2e-4},
                                         Case{0, 200, 200, ExposureOffsets({{}, Duration{-47'000'000}}), 1e-12, 4e-4},
                                         Case{0, 200, 200, ExposureOffsets({{}, Duration{10'000'000}}), 1e-12, 1e-4},
                                         Case{0, 200, 200, ExposureOffsets({Duration{-15'000'000}}), 2e-4, 1e-12},
                                         Case{kLineDelay_s, 20, 430, ExposureOffsets({{}, Duration{-25'000'000}}), 1e-4, 2e-4}));

/// The camera in which depths are seen has the rows of the left one.
TEST(Exposures, ADepthIsSeenWithItsPixel) {
  const StereoRig sensor = with_depth(cameras(kLineDelay_s), {});
  StereoRig rig = sensor;  // and the camera in which depths are seen
  rig.cameras.push_back({sensor.left(), depth_observer(sensor.T_BC0())});
  const Motion m{Vec3(0.8, -1.5, 2), Vec3::Zero(), Vec3(0, 0, 1), Vec3::Zero()};
  const Vec3 p_B = rig.T_BC0() * Vec3(0.8, -0.9, 3);
  TrackedFrame frame = frame_of(rig, m, p_B, 460, 460, {});
  Exposures(sensor).refer_to_stamp(ExposureMotion(m.readings({}), {}, kGravity_B), {{rig.T_BC(0), rig.T_BC(1)}}, frame);
  EXPECT_LT(error(*frame.features[0].left(), rig.T_BC(0), m.v, p_B), 1e-4);
  EXPECT_LT(error(*frame.features[0].right(), rig.T_BC(1), m.v, p_B), 3e-4);  // ten metres to the right
}

TEST(Exposures, BeforeTheStartTheTurnAloneIsKnown) {
  const StereoRig rig = cameras(kLineDelay_s);
  const Motion m{Vec3(0.8, -1.5, 2), Vec3(5, 10, -15), Vec3::Zero(), Vec3::Zero()};
  const Vec3 p_B = rig.T_BC0() * Vec3(0.4, -0.5, 2);
  TrackedFrame frame = frame_of(rig, m, p_B, 20, 470, {});
  Exposures(rig).refer_to_stamp(ExposureMotion(m.readings({}), {}), {{rig.T_BC(0), rig.T_BC(1)}}, frame);
  EXPECT_LT(error(*frame.features[0].left(), rig.T_BC(0), Vec3::Zero(), p_B), 1e-4);
  EXPECT_LT(error(*frame.features[0].right(), rig.T_BC(1), Vec3::Zero(), p_B), 1e-4);
}

TEST(Exposures, WhatIsSeenAtTheStampKeepsEveryBit) {
  const StereoRig rig = cameras(0);
  TrackedFrame frame = frame_of(rig, Motion{}, rig.T_BC0() * Vec3(0.8, -0.9, 3), 20, 40, {});
  const Vec2 before = frame.features[0].left()->normalised;
  const Exposures exposures(rig);
  EXPECT_TRUE(exposures.at_stamp(frame));
  exposures.refer_to_stamp(ExposureMotion(Motion{}.readings({}), {}, kGravity_B), {{rig.T_BC(0), rig.T_BC(1)}}, frame);
  EXPECT_EQ(frame.features[0].left()->normalised, before);
  EXPECT_EQ(frame.features[0].left()->displacement_B(Vec3(1, 2, 3)), Vec3::Zero());
  frame.offsets.set(1, Duration{1});
  EXPECT_FALSE(exposures.at_stamp(frame));
}

/// A global and a rolling shutter side by side, and the reverse.
TEST(Exposures, EachCameraHasItsOwnRows) {
  for (const bool right_rolls : {true, false}) {
    const CameraTimes global{}, rolling{.line_delay_s = kLineDelay_s};
    const StereoRig rig = with_times(cameras(0), {right_rolls ? global : rolling, right_rolls ? rolling : global});
    const Motion m;
    const Vec3 p_B = rig.T_BC0() * Vec3(0.4, -0.5, 2);
    TrackedFrame frame = frame_of(rig, m, p_B, 20, 40, {});
    const Vec2 before = frame.features[0].by(right_rolls ? 0 : 1)->normalised;
    const Exposures exposures(rig);
    EXPECT_FALSE(exposures.at_stamp(frame));
    exposures.refer_to_stamp(ExposureMotion(m.readings(kBias), kBias, kGravity_B), {{rig.T_BC(0), rig.T_BC(1)}}, frame);
    EXPECT_LT(error(*frame.features[0].left(), rig.T_BC(0), m.v, p_B), 1e-4);
    EXPECT_LT(error(*frame.features[0].right(), rig.T_BC(1), m.v, p_B), 1e-4);
    EXPECT_EQ(frame.features[0].by(right_rolls ? 0 : 1)->normalised, before);
  }
}

}  // namespace exposures_test
}  // namespace fbvins
