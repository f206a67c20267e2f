// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/guide.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/flight/excitation.hpp"

namespace fbvins {
namespace guide_test {

constexpr double kRate_hz = 200;

Mission mission(const std::string& text) { return *parse_mission(text, "m.yaml"); }

/// The setpoints for a vehicle that follows them exactly.
std::vector<PathSetpoint> guided(const Mission& m, double pace = 1, double stop_from_s = 1e9, double stop_to_s = 1e9) {
  Guide guide(m, kRate_hz);
  guide.begin({});
  std::vector<PathSetpoint> all{PathSetpoint{}};
  for (int k = 0; k < 120 * kRate_hz && !guide.done() && !guide.landing(); ++k) {
    const double t = k / kRate_hz;
    all.push_back(guide.next(t > stop_from_s && t < stop_to_s ? 0 : pace, all.back().p));
  }
  return all;
}

TEST(Guide, ReachesItsGoalsWithinTheLimits) {
  const Mission m = mission(
      "limits: {speed: 0.5, accel: 1, jerk: 4, climb: 0.4}\nsteps:\n  - takeoff: 0.6\n  - goto: [0.6, 0, 0.6]\n"
      "  - goto: {via: [[0.6, 2, 0.6]], to: [2, 2, 1]}\n  - hold: 1\n");
  const std::vector<PathSetpoint> all = guided(m);
  EXPECT_LT((all.back().p - Vec3(2, 2, 1)).norm(), 1e-6);
  bool corner = false;
  for (std::size_t i = 1; i < all.size(); ++i) {
    EXPECT_LE(all[i].v.norm(), 0.5 * 1.01);
    EXPECT_LE(all[i].a.norm(), 1.0 * 1.01);
    EXPECT_LE((all[i].a - all[i - 1].a).norm() * kRate_hz, 4.0 * 1.05);
    EXPECT_LE((all[i].p - all[i - 1].p - all[i].v / kRate_hz).norm(), 1e-4) << i;  // velocity is the derivative of position
    corner = corner || (all[i].p - Vec3(0.6, 0, 0.6)).norm() < 1e-6;
  }
  EXPECT_TRUE(corner);  // the end of a step is not rounded off
}

TEST(Guide, StopsAnywhereAndContinues) {
  const Mission m = mission("limits: {speed: 1, accel: 1}\nsteps:\n  - takeoff: 1\n  - goto: [4, 0, 1]\n  - hold: 0.5\n");
  const std::vector<PathSetpoint> all = guided(m, 1, 6, 12);
  const PathSetpoint& stopped = all[static_cast<std::size_t>(11.5 * kRate_hz)];
  EXPECT_LT(stopped.v.norm(), 0.01);
  EXPECT_LT(stopped.p.x(), 3.9);
  EXPECT_GT(stopped.p.x(), 0.1);
  for (std::size_t i = 1; i < all.size(); ++i) EXPECT_LT((all[i].v - all[i - 1].v).norm() * kRate_hz, 2.2) << i / kRate_hz;
  EXPECT_LT((all.back().p - Vec3(4, 0, 1)).norm(), 1e-6);
}

TEST(Guide, WaitsUntilTheVehicleHasArrived) {
  Guide guide(mission("steps:\n  - takeoff: 1\n  - hold: 5\n"), kRate_hz);
  guide.begin({});
  for (int k = 0; k < 10 * kRate_hz; ++k) (void)guide.next(1, {0, 0, 0.5});
  EXPECT_EQ(guide.step(), 0u);
  for (int k = 0; k < 10; ++k) (void)guide.next(1, {0, 0, 0.95});
  EXPECT_EQ(guide.step(), 1u);
}

TEST(Guide, YawsTheShortWayWithinItsRate) {
  const Mission m = mission("limits: {yaw_rate: 30}\nsteps:\n  - takeoff: 1\n  - yaw: 170\n  - yaw: -170\n");
  double fastest = 0;
  for (const PathSetpoint& s : guided(m)) fastest = std::max(fastest, std::abs(s.yaw_rate_radps));
  EXPECT_NEAR(fastest, 30 * 0.0174533, 0.01);
  EXPECT_NEAR(guided(m).back().yaw_rad, -170 * 0.0174533, 0.02);
  YawGuide yaw;
  yaw.set(170 * 0.0174533);
  yaw.turn(-170 * 0.0174533, 1, 0.01);
  EXPECT_GT(yaw.rate_radps(), 0);  // across 180 degrees
}

TEST(Guide, NoseForwardFollowsThePath) {
  const Mission m = mission("steps:\n  - takeoff: 1\n  - goto: {to: [0, 3, 1], nose: forward}\n  - hold: 3\n");
  EXPECT_NEAR(guided(m).back().yaw_rad, 1.5708, 0.02);
}

TEST(Guide, LandsFromAnywhere) {
  Guide guide(mission("limits: {speed: 1}\nsteps:\n  - takeoff: 1\n  - goto: [9, 0, 1]\n  - hold: 1\n"), kRate_hz);
  guide.begin({});
  PathSetpoint s;
  for (int k = 0; k < 8 * kRate_hz; ++k) s = guide.next(1, s.p);
  ASSERT_GT(s.v.x(), 0.5);
  const double from = s.p.x();
  guide.land_here();
  for (int k = 0; k < 6 * kRate_hz; ++k) s = guide.next(1, s.p);
  EXPECT_TRUE(guide.landing());
  EXPECT_LT(s.p.z(), 0);
  EXPECT_NEAR(s.v.x(), 0, 1e-3);
  EXPECT_LT(s.p.x(), from + 1);
}

TEST(Excitation, ExcitesOneAxisAfterTheOtherAroundTheHoverSetpoint) {
  PathSetpoint hover;
  hover.p = Vec3(1, 2, 3), hover.yaw_rad = 0.5;
  constexpr double kDt = 1e-4;
  Vec3 widest = Vec3::Zero();
  double turned = 0;
  for (double t = 0; t < excitation_length_s(); t += 0.003) {
    const PathSetpoint now = excitation_setpoint(hover, t), next = excitation_setpoint(hover, t + kDt);
    widest = widest.cwiseMax((now.p - hover.p).cwiseAbs());
    turned = std::max(turned, std::abs(now.yaw_rad - hover.yaw_rad));
    // The velocity neglects the slow change of the amplitude.
    EXPECT_LT(((next.p - now.p) / kDt - now.v).norm(), 0.3) << t;
    EXPECT_LT(now.a.norm(), 2.0);
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GT(widest[axis], 0.1);
    EXPECT_LE(widest[axis], 0.25);
  }
  EXPECT_GT(turned, 0.2);
  EXPECT_EQ(excitation_setpoint(hover, excitation_length_s()).p, hover.p);
}

}  // namespace guide_test
}  // namespace fbvins
