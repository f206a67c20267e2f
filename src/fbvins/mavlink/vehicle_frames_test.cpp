// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mavlink/vehicle_frames.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/core/angle.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/types/quality.hpp"

namespace fbvins {
namespace vehicle_frames_test {

constexpr Health kGood{HealthState::good, HealthReason::none};
const Vec3 kX(1, 0, 0), kY(0, 1, 0), kZ(0, 0, 1);

Odometry at_rest() {
  Odometry odometry;
  odometry.health = kGood;
  return odometry;
}

Vec3 random_vector(Rng& rng, double size) { return size * Vec3(rng.normal(), rng.normal(), rng.normal()); }

Odometry anywhere(Rng& rng) {
  Odometry o = at_rest();
  o.T_WB = {so3_exp(random_vector(rng, 1)), random_vector(rng, 10)};
  o.v_WB = random_vector(rng, 3), o.w_WB_B = random_vector(rng, 1);
  Mat6 A;
  for (int i = 0; i < 36; ++i) A(i) = 0.01 * rng.normal();
  o.pose_covariance = A * A.transpose();
  o.velocity_covariance = A.topRows<3>() * A.topRows<3>().transpose();
  return o;
}

MountingOptions odd_mounting() {
  MountingOptions options;
  options.imu_axes = ImuAxes::camera_fwd;
  options.roll_rad = 0.1, options.pitch_rad = -0.4, options.yaw_rad = 2.0;
  options.x_m = 0.12, options.y_m = -0.03, options.z_m = 0.05;
  return options;
}

/// A vehicle that stands level and looks along W's x axis, with the IMU mounted somehow.
Odometry level_vehicle(const MountingOptions& options) {
  Odometry o = at_rest();
  const Pose<W, BodyFrd> T_WF(Quat(0, 1, 0, 0), Vec3::Zero());
  o.T_WB = T_WF * mounting(options);
  return o;
}

TEST(VehicleFrames, EachChoiceOfAxesPointsWhereItSays) {
  const auto in_vehicle = [](ImuAxes axes, const Vec3& v_B) {
    MountingOptions options;
    options.imu_axes = axes;
    return Vec3(mounting(options).q * v_B);
  };
  EXPECT_TRUE(in_vehicle(ImuAxes::frd, kX).isApprox(kX) && in_vehicle(ImuAxes::frd, kZ).isApprox(kZ));
  EXPECT_TRUE(in_vehicle(ImuAxes::flu, kX).isApprox(kX) && in_vehicle(ImuAxes::flu, kZ).isApprox(-kZ));
  EXPECT_TRUE(in_vehicle(ImuAxes::camera_fwd, kZ).isApprox(kX) && in_vehicle(ImuAxes::camera_fwd, kX).isApprox(kY));
  EXPECT_TRUE(in_vehicle(ImuAxes::camera_down, kZ).isApprox(kZ) && in_vehicle(ImuAxes::camera_down, kY).isApprox(-kX));
}

TEST(VehicleFrames, AnglesTurnLikeTheVehicles) {
  const auto forward = [](double roll_rad, double pitch_rad, double yaw_rad) {
    MountingOptions options;
    options.imu_axes = ImuAxes::frd;
    options.roll_rad = roll_rad, options.pitch_rad = pitch_rad, options.yaw_rad = yaw_rad;
    return mounting(options);
  };
  EXPECT_LT((forward(0, 0.2, 0).q * kX).z(), 0);             // pitched up: forward looks up
  EXPECT_GT((forward(0, 0, 0.2).q * kX).y(), 0);             // yawed: forward looks right
  EXPECT_GT((forward(0.2, 0, 0).q * kY).z(), 0);             // rolled: the right side is down
  EXPECT_GT((forward(kDegree * 90, 0, 0.2).q * kX).y(), 0);  // roll first
}

TEST(VehicleFrames, UpIsMinusZAndForwardIsXWhereTheVehicleStarts) {
  for (const MountingOptions& options : {MountingOptions{}, odd_mounting()}) {
    VehicleFrames frames(options);
    Odometry o = level_vehicle(options);
    o.T_WB = Pose<W, W>(so3_exp(Vec3(0, 0, 1.2)), Vec3::Zero()) * o.T_WB;  // looks anywhere
    const VehicleState start = *frames.state(o);
    EXPECT_TRUE(start.T_LF.q.isApprox(Quat::Identity(), 1e-12) || start.T_LF.q.isApprox(Quat(-1, 0, 0, 0), 1e-12));
    EXPECT_LT(start.T_LF.p.norm(), 1e-12);
    const Vec3 forward_W(std::cos(1.2), std::sin(1.2), 0), left_W(-std::sin(1.2), std::cos(1.2), 0);
    o.T_WB.p += 2 * forward_W + 1 * left_W + 3 * Vec3(0, 0, 1);
    o.v_WB = 0.5 * left_W;
    const VehicleState moved = *frames.state(o);
    EXPECT_TRUE(moved.T_LF.p.isApprox(Vec3(2, -1, -3), 1e-12)) << moved.T_LF.p.transpose();
    EXPECT_TRUE(moved.v_LF_F.isApprox(Vec3(0, -0.5, 0), 1e-12));
  }
}

TEST(VehicleFrames, LocalMayBeTheWorldTurnedAboutX) {
  MountingOptions options = odd_mounting();
  options.local_frame = LocalOrigin::world;
  Rng rng(3);
  const Odometry o = anywhere(rng);
  const VehicleState state = *VehicleFrames(options).state(o);
  const Vec3 p_WF = o.T_WB * mounting(options).inverse().p;
  EXPECT_TRUE(state.T_LF.p.isApprox(Vec3(p_WF.x(), -p_WF.y(), -p_WF.z()), 1e-12));
}

TEST(VehicleFrames, VelocityAndRatesAreThoseOfTheVehiclesOrigin) {
  Rng rng(4);
  const MountingOptions options = odd_mounting();
  VehicleFrames frames(options);
  const Odometry before = anywhere(rng);
  const double dt_s = 1e-6;
  Odometry after = before;
  after.T_WB = {before.T_WB.q * so3_exp(before.w_WB_B * dt_s), before.T_WB.p + before.v_WB * dt_s};
  const VehicleState a = *frames.state(before), b = *frames.state(after);
  EXPECT_LT((a.T_LF.q.conjugate() * (b.T_LF.p - a.T_LF.p) / dt_s - a.v_LF_F).norm(), 1e-5);
  EXPECT_LT((so3_log(a.T_LF.q.conjugate() * b.T_LF.q) / dt_s - a.w_LF_F).norm(), 1e-5);
}

TEST(VehicleFrames, CovarianceIsThatOfErrorsCarriedAlong) {
  Rng rng(5);
  for (int round = 0; round < 20; ++round) {
    const Odometry o = anywhere(rng);
    VehicleFrames frames(odd_mounting());
    const VehicleState state = *frames.state(o);
    // Jacobian of (dp in L, dtheta in L) by the odometry's errors, column by column.
    Mat6 J;
    for (int i = 0; i < 6; ++i) {
      Vec6 e = Vec6::Zero();
      e(i) = 1e-7;
      Odometry off = o;
      off.T_WB = o.T_WB.boxplus(e.head<3>(), e.tail<3>());
      const VehicleState moved = *frames.state(off);
      J.col(i) << (moved.T_LF.p - state.T_LF.p) / 1e-7, so3_log(moved.T_LF.q * state.T_LF.q.conjugate()) / 1e-7;
    }
    EXPECT_LT((J * o.pose_covariance * J.transpose() - state.pose_covariance).norm(), 1e-5 * state.pose_covariance.norm());
    const Mat3 R_FW = (o.T_WB.R() * mounting(odd_mounting()).R().transpose()).transpose();
    EXPECT_LT((R_FW * o.velocity_covariance * R_FW.transpose() - state.velocity_covariance).norm(), 1e-12);
  }
}

TEST(VehicleFrames, AfterARestartTheLocalFrameGoesOnWhereTheVehicleWasLastSeen) {
  const MountingOptions options = odd_mounting();
  VehicleFrames frames(options);
  Odometry o = level_vehicle(options);
  ASSERT_TRUE(frames.state(o));
  o.T_WB = Pose<W, W>(so3_exp(Vec3(0, 0, 0.7)), Vec3(3, 4, 1)) * o.T_WB;
  const VehicleState before = *frames.state(o);
  EXPECT_NEAR(so3_log(before.T_LF.q).norm(), 0.7, 1e-9);
  o.T_WB = Pose<W, W>(so3_exp(Vec3(0, 0, -2)), Vec3(-1, 8, 0)) * o.T_WB;  // another world
  o.reset_counter = 1;
  const VehicleState after = *frames.state(o);
  EXPECT_LT((after.T_LF.p - before.T_LF.p).norm(), 1e-9);
  EXPECT_LT(so3_log(after.T_LF.q.conjugate() * before.T_LF.q).norm(), 1e-9);
  EXPECT_EQ(after.reset_counter, 1u);
  o.T_WB.p.z() += 2;
  EXPECT_NEAR((frames.state(o)->T_LF.p - after.T_LF.p).z(), -2, 1e-9);
}

TEST(VehicleFrames, WithoutATrustworthyPoseThereIsNoState) {
  VehicleFrames frames({});
  Odometry o = at_rest();
  o.health = {HealthState::lost, HealthReason::no_tracks};
  EXPECT_FALSE(frames.state(o));
  o.health = {HealthState::degraded, HealthReason::few_tracks};
  EXPECT_TRUE(frames.state(o));
  o.v_WB.x() = std::nan("");
  EXPECT_FALSE(frames.state(o));
}

TEST(VehicleMessages, OdometryHasTheStateAndTheTriangleByRows) {
  Rng rng(6);
  VehicleFrames frames(odd_mounting());
  Odometry o = anywhere(rng);
  o.reset_counter = 258;
  const VehicleState state = *frames.state(o);
  const OdometryMessage m = odometry_message(state, 77);
  EXPECT_EQ(m.time_usec, 77u);
  EXPECT_EQ(m.frame_id, 20);
  EXPECT_EQ(m.child_frame_id, 12);
  EXPECT_EQ(m.estimator_type, 3);
  EXPECT_EQ(m.quality, quality_percent(state.health, state.pose_covariance));
  EXPECT_EQ(m.reset_counter, 2);
  EXPECT_FLOAT_EQ(m.q[0], static_cast<float>(state.T_LF.q.w()));
  EXPECT_FLOAT_EQ(m.z, static_cast<float>(state.T_LF.p.z()));
  EXPECT_FLOAT_EQ(m.vy, static_cast<float>(state.v_LF_F.y()));
  EXPECT_FLOAT_EQ(m.yawspeed, static_cast<float>(state.w_LF_F.z()));
  for (const auto& [at, row, column] : {std::tuple{0u, 0, 0}, {1u, 0, 1}, {6u, 1, 1}, {11u, 2, 2}, {15u, 3, 3}, {20u, 5, 5}})
    EXPECT_FLOAT_EQ(m.pose_covariance[at], static_cast<float>(state.pose_covariance(row, column)));
  EXPECT_FLOAT_EQ(m.velocity_covariance[7], static_cast<float>(state.velocity_covariance(1, 2)));
  EXPECT_FLOAT_EQ(m.velocity_covariance[11], static_cast<float>(state.velocity_covariance(2, 2)));
  EXPECT_TRUE(std::isnan(m.velocity_covariance[15]));
}

TEST(VehicleMessages, VisionMessagesAreInTheLocalFrame) {
  Rng rng(7);
  VehicleFrames frames(odd_mounting());
  const VehicleState state = *frames.state(anywhere(rng));
  const VisionPositionMessage m = vision_position_message(state, 1);
  const Quat q = so3_exp(Vec3(0, 0, m.yaw)) * so3_exp(Vec3(0, m.pitch, 0)) * so3_exp(Vec3(m.roll, 0, 0));
  EXPECT_LT(so3_log(q.conjugate() * state.T_LF.q).norm(), 1e-6);
  const VisionSpeedMessage speed = vision_speed_message(state, 1);
  const Vec3 v_L = state.T_LF.q * state.v_LF_F;
  EXPECT_LT((Vec3(speed.x, speed.y, speed.z) - v_L).norm(), 1e-5);
  const Mat3 R = state.T_LF.R();
  const Mat3 covariance_L = R * state.velocity_covariance * R.transpose();
  EXPECT_FLOAT_EQ(speed.covariance[5], static_cast<float>(covariance_L(1, 2)));
}

TEST(VehicleMessages, QualityIsPositiveOnlyWhereOneMayFly) {
  for (const HealthState state : {HealthState::initialising, HealthState::good, HealthState::degraded, HealthState::lost}) {
    const Health health{state, HealthReason::none};
    EXPECT_EQ(odometry_quality(health, 1e-4 * Mat6::Identity()) > 0, health.has_pose());
    EXPECT_EQ(odometry_quality(health, 1e12 * Mat6::Identity()) > 0, health.has_pose());
  }
  const OdometryMessage none = no_odometry_message({HealthState::lost, HealthReason::no_tracks}, 3, 9);
  EXPECT_EQ(none.quality, -1);
  EXPECT_EQ(none.reset_counter, 3);
  EXPECT_TRUE(std::isnan(none.x) && std::isnan(none.q[0]) && std::isnan(none.vx) && std::isnan(none.pose_covariance[0]));
  EXPECT_EQ(no_odometry_message(kGood, 0, 0).quality, 0);  // good, but not finite
}

TEST(VehicleMessages, HealthIsASentenceThatFits) {
  const StatusTextMessage m = health_message({HealthState::degraded, HealthReason::waiting_for_motion_or_rest});
  EXPECT_EQ(m.severity, MavSeverity::warning);
  EXPECT_EQ(std::string(m.text.data()), "VIO degraded: waiting_for_motion_or_rest");
  EXPECT_EQ(health_message(kGood).text[8], '\0');
  EXPECT_EQ(status_text(MavSeverity::info, std::string(80, 'x')).text[49], 'x');
}

MapUpdate m_is_at(const Pose<M, W>& T_MW_smooth, std::uint32_t reset_counter = 0) {
  MapUpdate update;
  update.localised = true;
  update.T_MW_smooth = T_MW_smooth;
  update.reset_counter = reset_counter;
  return update;
}

MountingOptions in_map() {
  MountingOptions options;
  options.local_frame = LocalOrigin::map;
  return options;
}

Pose<M, W> somewhere() { return {so3_exp(Vec3(0, 0, 0.3)), Vec3(2, -1, 0.5)}; }

/// With M's z down; the mounting is turned by half a turn about x.
void expect_at(const VehicleState& state, const Pose<M, B>& T_MB) {
  EXPECT_LT((state.T_LF.p - Vec3(T_MB.p.x(), -T_MB.p.y(), -T_MB.p.z())).norm(), 1e-12);
  const Quat q_LF = Quat(0, 1, 0, 0) * T_MB.q * mounting(in_map()).inverse().q;
  EXPECT_LT(so3_log(q_LF.conjugate() * state.T_LF.q).norm(), 1e-12);
}

TEST(VehicleFrames, InMPosesFollowIt) {
  VehicleFrames frames(in_map());
  Rng rng(8);
  Odometry o = anywhere(rng);
  expect_at(*frames.state(o), Pose<M, W>{} * o.T_WB);
  const double before = frames.state(o)->pose_covariance.norm();
  for (int i = 1; i < 4; ++i) {  // by small corrections
    const Pose<M, W> T_MW{so3_exp(Vec3(0, 0, 0.001 * i)), Vec3(0.01 * i, 0, 0)};
    frames.take(m_is_at(T_MW));
    const VehicleState state = *frames.state(o);
    expect_at(state, T_MW * o.T_WB);
    EXPECT_EQ(state.reset_counter, 0u);
    EXPECT_NEAR(state.pose_covariance.norm(), before, 1e-9);
  }
  VehicleFrames in_w({});
  const Pose<LocalFrd, BodyFrd> here = in_w.state(o)->T_LF;
  in_w.take(m_is_at(somewhere()));
  EXPECT_EQ(in_w.state(o)->T_LF.p, here.p) << "who flies in W is not moved";
}

TEST(VehicleFrames, AJumpOfMIsToldByTheCounter) {
  VehicleFrames frames(in_map());
  Rng rng(9);
  Odometry o = anywhere(rng);
  ASSERT_TRUE(frames.state(o));
  MapUpdate unknown;
  frames.take(unknown);  // a loaded map, in which the flight is not found yet
  expect_at(*frames.state(o), Pose<M, W>{} * o.T_WB);
  MapUpdate found = m_is_at(somewhere());
  found.found = true;
  frames.take(found);
  expect_at(*frames.state(o), somewhere() * o.T_WB);
  EXPECT_EQ(frames.state(o)->reset_counter, 1u);
  MapUpdate levelled = m_is_at(somewhere());
  levelled.M_moved = Pose<M, M>{so3_exp(Vec3(0.01, 0, 0)), Vec3::Zero()};  // T_MW_smooth has no part in that
  frames.take(levelled);
  EXPECT_EQ(frames.state(o)->reset_counter, 1u);
  MapUpdate anchored = m_is_at({so3_exp(Vec3(0, 0, 2)), Vec3(20, 30, 0)});
  anchored.M_moved = Pose<M, M>{};
  anchored.anchored = true;
  frames.take(anchored);
  EXPECT_EQ(frames.state(o)->reset_counter, 2u);
  expect_at(*frames.state(o), anchored.T_MW_smooth * o.T_WB);
}

TEST(VehicleFrames, InMARestartGoesOnWhereTheVehicleWasUntilItIsFound) {
  VehicleFrames frames(in_map());
  Rng rng(10);
  Odometry o = anywhere(rng);
  frames.take(m_is_at(somewhere()));
  const VehicleState before = *frames.state(o);
  o.T_WB = Pose<W, W>(so3_exp(Vec3(0, 0, 0.4)), Vec3(5, 5, 5)) * o.T_WB;
  o.reset_counter = 1;
  const VehicleState after = *frames.state(o);
  EXPECT_EQ(after.reset_counter, 1u);
  EXPECT_LT((after.T_LF.p - before.T_LF.p).norm(), 1e-9);
  frames.take(m_is_at(Pose<M, W>{}, 0));  // late, of the W that has ended
  EXPECT_LT((frames.state(o)->T_LF.p - before.T_LF.p).norm(), 1e-9);
  frames.take(m_is_at(somewhere(), 1));
  EXPECT_EQ(frames.state(o)->reset_counter, 2u);
  expect_at(*frames.state(o), somewhere() * o.T_WB);
}

}  // namespace vehicle_frames_test
}  // namespace fbvins
