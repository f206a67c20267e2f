// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/flight.hpp"

#include <gtest/gtest.h>

#include "fbvins/sim/simulation.hpp"

namespace fbvins {
namespace flight_test {

SplineTrajectory fly(FlightOptions options, std::uint64_t seed) {
  const std::vector<Vec3> tour{{-3, -2, 1.4}, {3, -2, 1.4}, {3, 2, 1.4}, {-3, 2, 1.4}};
  return make_flight(options, body_in_vehicle(euroc_rig(), options.camera_pitch_deg), tour, seed);
}

TEST(Flight, EveryKindKeepsItsLimits) {
  for (const char* kind : {"hover", "waypoint", "aggressive", "takeoff", "tour"})
    for (std::uint64_t seed : {1, 2, 3}) {
      FlightOptions options;
      options.kind = kind;
      options.duration_s = 25;
      if (options.kind == "aggressive") options.max_speed_mps = 3, options.max_accel_mps2 = 6, options.max_jerk_mps3 = 40;
      const SplineTrajectory flight = fly(options, seed);
      EXPECT_NEAR(flight.duration_s(), 25, 0.3) << kind;
      double fastest = 0;
      for (double t = 0; t < flight.duration_s(); t += 0.013) {
        const MotionState m = flight.at(t);
        fastest = std::max(fastest, m.v_WB.norm());
        ASSERT_LE(m.v_WB.norm(), options.max_speed_mps * 1.001) << kind << " at " << t;
        ASSERT_LE(m.a_WB.norm(), options.max_accel_mps2 * 1.001) << kind << " at " << t;
        ASSERT_LE(m.j_WB.norm(), options.max_jerk_mps3 * 1.001) << kind << " at " << t;
        ASSERT_LE(m.w_WB_B.norm(), 10.0) << kind << " at " << t;
      }
      if (options.kind != "hover") {
        EXPECT_GT(fastest, 0.35 * options.max_speed_mps) << kind << " seed " << seed;
      }
    }
}

TEST(Flight, RestsAtTheStart) {
  for (const char* kind : {"hover", "waypoint", "aggressive", "takeoff", "tour"}) {
    FlightOptions options;
    options.kind = kind;
    options.rest_s = 2;
    const SplineTrajectory flight = fly(options, 5);
    for (double t = 0; t < 1.9; t += 0.05) {
      EXPECT_LT(flight.at(t).v_WB.norm(), 1e-3) << kind;
      EXPECT_LT(flight.at(t).w_WB_B.norm(), 1e-2) << kind;
    }
  }
}

TEST(Flight, ThrustPointsAlongTheSpecificForce) {
  FlightOptions options;
  options.kind = "aggressive";
  options.max_speed_mps = 3, options.max_accel_mps2 = 6, options.max_jerk_mps3 = 40;
  const SplineTrajectory flight = fly(options, 2);
  const Quat q_VB = body_in_vehicle(euroc_rig(), options.camera_pitch_deg);
  for (double t = 3; t < 25; t += 0.31) {
    const MotionState m = flight.at(t);
    const Vec3 up = m.T_WB.q * q_VB.conjugate() * Vec3::UnitZ();
    EXPECT_LT(std::acos(std::min(1.0, up.dot((m.a_WB + Vec3(0, 0, kSimGravity_mps2)).normalized()))), 0.06) << t;
  }
}

TEST(Flight, CameraLooksForwardAndDown) {
  const StereoRig rig = euroc_rig();
  const Vec3 forward = body_in_vehicle(rig, 20) * (rig.T_BC0().q * Vec3::UnitZ());
  EXPECT_LT((forward - Vec3(std::cos(20 * 3.14159265 / 180), 0, -std::sin(20 * 3.14159265 / 180))).norm(), 1e-6);
}

TEST(Flight, AnotherSeedIsAnotherFlightTheSameSeedTheSameBits) {
  FlightOptions options;
  EXPECT_EQ(fly(options, 7).pose(12.3).p, fly(options, 7).pose(12.3).p);
  EXPECT_GT((fly(options, 7).pose(12.3).p - fly(options, 8).pose(12.3).p).norm(), 0.05);
}

}  // namespace flight_test
}  // namespace fbvins
