// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/px4_frames.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "fbvins/core/rng.hpp"
#include "fbvins/flight/closed_loop.hpp"
#include "fbvins/mavlink/vehicle_frames.hpp"

namespace fbvins {
namespace px4_frames_test {

Quat any_rotation(Rng& rng) {
  return so3_exp(3.1 * Vec3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)).normalized());
}

TEST(Px4Frames, MountingOptionsKeepTheMounting) {
  Rng rng(3);
  std::vector<Pose<BodyFlu, B>> mountings{{Quat::Identity(), Vec3(0.04, 0.01, 0.03)}};
  // EuRoC's: with FRD axes its pitch would be 90 degrees (gimbal lock).
  Mat3 R;
  R << 0, 0, 1, 0, -1, 0, 1, 0, 0;
  mountings.emplace_back(Quat(R), Vec3(0.1, 0, -0.02));
  for (int i = 0; i < 20; ++i) mountings.emplace_back(any_rotation(rng), Vec3(rng.normal(), rng.normal(), rng.normal()));
  for (const auto& T_VB : mountings) {
    const Pose<BodyFrd, B> told = mounting(mounting_options_of(T_VB));
    EXPECT_EQ(mounting_options_of(T_VB).local_frame, LocalOrigin::vehicle);
    EXPECT_EQ(mounting_options_of(T_VB, true).local_frame, LocalOrigin::map);
    const Vec3 x(0.3, -0.2, 0.9);
    EXPECT_LT((told * x - flu_to_frd(Vec3(T_VB * x))).norm(), 1e-9);
  }
}

TEST(Px4Frames, EstimatesOfPx4HaveZUp) {
  OdometryMessage m;
  m.x = 1, m.y = 2, m.z = -3;
  m.q = {static_cast<float>(std::cos(0.25)), 0, 0, static_cast<float>(std::sin(0.25))};  // half a radian to the right
  m.vx = 1;                                                                              // forward
  m.yawspeed = 0.5;
  const VehicleEstimate e = estimate_of(m);
  EXPECT_LT((e.T_LV.p - Vec3(1, -2, 3)).norm(), 1e-6);
  EXPECT_LT(so3_log(e.T_LV.q.conjugate() * so3_exp(Vec3(0, 0, -0.5))).norm(), 1e-6);
  EXPECT_LT((e.v_LV - Vec3(std::cos(0.5), -std::sin(0.5), 0)).norm(), 1e-6);
  EXPECT_NEAR(e.w_LV_V.z(), -0.5, 1e-6);
}

TEST(Px4Frames, ASetpointIsReachedInPx4sFrame) {
  Rng rng(4);
  const Pose<Local, Px4Local> T_LN(so3_exp(Vec3(0, 0, 0.7)), Vec3(3, -1, 0.2));
  PathSetpoint wanted;
  wanted.p = Vec3(0.6, 0.3, 0.6), wanted.v = Vec3(0.1, -0.2, 0.3), wanted.a = Vec3(1, 2, 3);
  wanted.yaw_rad = 0.4, wanted.yaw_rate_radps = 0.2;
  const PositionTargetMessage m = target_message(wanted, T_LN, 77);
  // PX4's odometry of a vehicle at the setpoint.
  OdometryMessage there;
  there.x = m.x, there.y = m.y, there.z = m.z;
  there.q = {std::cos(m.yaw / 2), 0, 0, std::sin(m.yaw / 2)};
  there.child_frame_id = kMavFrameLocalNed;
  there.vx = m.vx, there.vy = m.vy, there.vz = m.vz;
  const VehicleEstimate e = estimate_of(there);
  EXPECT_LT((T_LN * e.T_LV.p - wanted.p).norm(), 1e-6);
  EXPECT_LT((T_LN.q * e.v_LV - wanted.v).norm(), 1e-6);
  EXPECT_LT((T_LN.q * flu_to_frd(Vec3(m.afx, m.afy, m.afz)) - wanted.a).norm(), 1e-6);
  const Vec3 nose = T_LN.q * e.T_LV.q * Vec3::UnitX();
  EXPECT_NEAR(std::atan2(nose.y(), nose.x()), wanted.yaw_rad, 1e-6);
  EXPECT_NEAR(m.yaw_rate, -0.2, 1e-6);
  EXPECT_EQ(m.type_mask, 0);
}

TEST(Px4Frames, AStandingVehicleMeasuresGravityUpwards) {
  HilSensorMessage m = sensor_message({0, Vec3(0, 0.1, 9.81), Vec3(0, 0, 0.2)}, 5);
  EXPECT_FLOAT_EQ(m.zacc, -9.81F);
  EXPECT_FLOAT_EQ(m.yacc, -0.1F);
  EXPECT_FLOAT_EQ(m.zgyro, -0.2F);
  EXPECT_EQ(m.fields_updated, HilSensorMessage::kImu);
  add_height(m, 100);
  EXPECT_NEAR(m.abs_pressure, 1001.29, 0.05);  // ISA: 1001.29 hPa at 100 m
  EXPECT_EQ(m.fields_updated & HilSensorMessage::kBarometer, HilSensorMessage::kBarometer);
}

TEST(Px4Frames, ParametersHaveGainsAndRotorsAndDisableGps) {
  const QuadrotorOptions vehicle;
  const Px4Parameters list = px4_parameters(control_for(vehicle), vehicle);
  const std::map<std::string, std::string> all(list.begin(), list.end());
  EXPECT_EQ(all.size(), list.size()) << "duplicate name";
  EXPECT_EQ(all.at("EKF2_GPS_CTRL"), "0");
  EXPECT_EQ(all.at("EKF2_MAG_TYPE"), "5");
  EXPECT_EQ(all.at("MPC_XY_P"), "1.5");
  EXPECT_EQ(all.at("MC_ROLLRATE_P"), "0.15");
  EXPECT_EQ(all.at("CA_ROTOR2_PX"), "0.1167");
  EXPECT_EQ(all.at("CA_ROTOR2_PY"), "-0.1167");
  EXPECT_EQ(all.at("CA_ROTOR2_KM"), "-0.0150");
}

}  // namespace px4_frames_test
}  // namespace fbvins
