// SPDX-License-Identifier: Apache-2.0
// The cascaded controller on true states.
#include "fbvins/flight/controller.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "fbvins/core/options.hpp"
#include "fbvins/sim/wind.hpp"

namespace fbvins {
namespace controller_test {

constexpr double kRate_hz = 200;
constexpr int kStepsPerUpdate = 5;

struct Craft {
  QuadrotorOptions vehicle;
  ControlOptions control;
};

Craft craft(const std::string& name) {
  Craft c{*quadrotor_preset(name), {}};
  if (name == "sih") {
    c.control.position.MPC_THR_HOVER = c.vehicle.mass_kg * kSimGravity_mps2 / 20;
    c.control.THR_MDL_FAC = 0;
  }
  return c;
}

VehicleEstimate truth(const Quadrotor& vehicle) {
  const QuadrotorState& s = vehicle.state();
  return {s.T_WV.cast_frames<Local, BodyFlu>(), s.v_WV, s.w_WV_V};
}

/// Hovering at rest at p.
QuadrotorState hovering(const QuadrotorOptions& o, const Vec3& p) {
  QuadrotorState s;
  s.T_WV.p = p;
  s.rotor_radps.fill(std::sqrt(o.mass_kg * kSimGravity_mps2 / (4 * o.thrust_N_per_radps2)));
  return s;
}

/// Flies along setpoint(t); `look` is called at every update.
void fly(Quadrotor& vehicle, CascadeController& controller, double seconds, const std::function<PathSetpoint(double)>& setpoint,
         const std::function<void(double, const Quadrotor&)>& look = {}, Wind* wind = nullptr) {
  for (int k = 0; k < std::lround(seconds * kRate_hz); ++k) {
    const double t = k / kRate_hz;
    const PerRotor commands = controller.fly(truth(vehicle), setpoint(t));
    for (int i = 0; i < kStepsPerUpdate; ++i)
      vehicle.step(commands, wind ? wind->step(Quadrotor::kStep_s, vehicle.state().T_WV.p.z()) : Vec3(Vec3::Zero()));
    if (look) look(t, vehicle);
  }
}

class EachCraft : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Controller, EachCraft, ::testing::Values("indoor330", "sih"));

TEST_P(EachCraft, HoldsAPlaceInTheWind) {
  const Craft c = craft(GetParam());
  Quadrotor vehicle(c.vehicle, hovering(c.vehicle, {0, 0, 1.5}));
  CascadeController controller(c.control, kRate_hz);
  Wind wind({.mean_mps = 1.0, .gust_mps = 0, .gust_s = 1}, 7);
  fly(
      vehicle, controller, 25,
      [](double) {
        return PathSetpoint{.p = {0, 0, 1.5}};
      },
      {}, &wind);
  EXPECT_LT((vehicle.state().T_WV.p - Vec3(0, 0, 1.5)).norm(), 0.01);  // the integral compensates the wind
  EXPECT_LT(vehicle.state().v_WV.norm(), 0.02);
}

TEST_P(EachCraft, StepOfPositionSettlesWithoutMuchOvershoot) {
  const Craft c = craft(GetParam());
  Quadrotor vehicle(c.vehicle, hovering(c.vehicle, {0, 0, 1.5}));
  CascadeController controller(c.control, kRate_hz);
  double furthest = 0, late = 0;
  fly(
      vehicle, controller, 12,
      [](double) {
        return PathSetpoint{.p = {1, 0, 1.5}};
      },
      [&](double t, const Quadrotor& v) {
        furthest = std::max(furthest, v.state().T_WV.p.x());
        if (t > 9) late = std::max(late, (v.state().T_WV.p - Vec3(1, 0, 1.5)).norm());
      });
  EXPECT_LT(furthest, 1.3);
  EXPECT_LT(late, 0.05);
}

TEST_P(EachCraft, FollowsACircle) {
  const Craft c = craft(GetParam());
  const double radius = 1, w = 1;  // 1 m/s, 1 m/s^2
  const auto circle = [&](double t) {
    const double s = std::sin(w * t), k = std::cos(w * t);
    return PathSetpoint{.p = {radius * k, radius * s, 1.5},
                        .v = {-radius * w * s, radius * w * k, 0},
                        .a = {-radius * w * w * k, -radius * w * w * s, 0}};
  };
  Quadrotor vehicle(c.vehicle, hovering(c.vehicle, circle(0).p));
  CascadeController controller(c.control, kRate_hz);
  double worst = 0;
  fly(vehicle, controller, 20, circle, [&](double t, const Quadrotor& v) {
    if (t > 8) worst = std::max(worst, (v.state().T_WV.p - circle(t).p).norm());
  });
  EXPECT_LT(worst, GetParam() == "sih" ? 0.45 : 0.2);  // SIH's drag, 1 N at 1 m/s, turns with the velocity
}

TEST_P(EachCraft, TurnsToAHeadingTheShortWay) {
  const Craft c = craft(GetParam());
  Quadrotor vehicle(c.vehicle, hovering(c.vehicle, {0, 0, 1.5}));
  CascadeController controller(c.control, kRate_hz);
  fly(vehicle, controller, 6, [](double) { return PathSetpoint{.p = {0, 0, 1.5}, .yaw_rad = 2.0}; });
  const Vec3 nose = vehicle.state().T_WV.q * Vec3::UnitX();
  EXPECT_NEAR(std::atan2(nose.y(), nose.x()), 2.0, 0.02);
  EXPECT_LT((vehicle.state().T_WV.p - Vec3(0, 0, 1.5)).norm(), 0.05);
}

TEST_P(EachCraft, RightsItselfFromUpsideDown) {
  const Craft c = craft(GetParam());
  QuadrotorState start = hovering(c.vehicle, {0, 0, 30});
  start.T_WV.q = so3_exp(Vec3(std::numbers::pi - 0.1, 0.05, 0.3));
  Quadrotor vehicle(c.vehicle, start);
  CascadeController controller(c.control, kRate_hz);
  fly(vehicle, controller, 15, [](double) { return PathSetpoint{.p = {0, 0, 30}}; });
  EXPECT_GT((vehicle.state().T_WV.q * Vec3::UnitZ()).z(), 0.99);
  EXPECT_LT((vehicle.state().T_WV.p - Vec3(0, 0, 30)).norm(), 0.3);
}

TEST(Controller, LevelDescendsAtTheGivenSpeed) {
  const Craft c = craft("indoor330");
  QuadrotorState start = hovering(c.vehicle, {0, 0, 20});
  start.v_WV = Vec3(0.5, 0, 0);
  Quadrotor vehicle(c.vehicle, start);
  CascadeController controller(c.control, kRate_hz);
  for (int k = 0; k < 5 * kRate_hz; ++k) {
    const PerRotor commands = controller.level(truth(vehicle), -0.5, 0);
    for (int i = 0; i < kStepsPerUpdate; ++i) vehicle.step(commands, Vec3::Zero());
  }
  EXPECT_NEAR(vehicle.state().v_WV.z(), -0.5, 0.05);
  EXPECT_GT((vehicle.state().T_WV.q * Vec3::UnitZ()).z(), 0.9999);
}

TEST(Controller, TheIntegralCorrectsAWrongHoverThrust) {
  Craft c = craft("indoor330");
  c.control.position.MPC_THR_HOVER = 0.5;
  Quadrotor vehicle(c.vehicle, hovering(c.vehicle, {0, 0, 1.5}));
  CascadeController controller(c.control, kRate_hz);
  fly(vehicle, controller, 15, [](double) { return PathSetpoint{.p = {0, 0, 1.5}}; });
  EXPECT_NEAR(vehicle.state().T_WV.p.z(), 1.5, 0.01);
}

TEST(PositionController, RespectsTheLimitsOfTiltAndSpeed) {
  PositionControlOptions o;
  o.MPC_TILTMAX_AIR = 20;
  o.MPC_XY_VEL_MAX = 2;
  PositionController position(o, kRate_hz);
  const AttitudeSetpoint wanted = position.update({}, PathSetpoint{.p = {1000, -500, 0}});
  EXPECT_NEAR(position.velocity_setpoint().head<2>().norm(), 2, 1e-9);
  const double tilt = std::acos((wanted.q_LV * Vec3::UnitZ()).z()) * 180 / std::numbers::pi;
  EXPECT_NEAR(tilt, 20, 1e-6);
}

TEST(PositionController, TheIntegralDoesNotWindUp) {
  PositionControlOptions o;
  PositionController position(o, kRate_hz);
  for (int i = 0; i < 60 * kRate_hz; ++i) (void)position.update({}, PathSetpoint{.p = {0, 0, 1000}});  // held down for a minute
  VehicleEstimate above;
  above.T_LV.p = Vec3(0, 0, 1001);
  double thrust = 1;
  for (int i = 0; i < 2 * kRate_hz; ++i) thrust = position.update(above, PathSetpoint{.p = {0, 0, 1000}}).thrust;
  EXPECT_LT(thrust, o.MPC_THR_HOVER);
}

TEST(Mixer, GivesTheRequestedThrustAndTorqueWithinLimits) {
  const MixedMotors motors = mix(0.4, {0.1, -0.2, 0.05}, 0);
  const PerRotor& u = motors.commands;
  EXPECT_NEAR((u[0] + u[1] + u[2] + u[3]) / 4, 0.4, 1e-12);
  EXPECT_NEAR((-u[0] + u[1] + u[2] - u[3]) / 4 * std::numbers::sqrt2, 0.1, 1e-12);
  EXPECT_NEAR((-u[0] + u[1] - u[2] + u[3]) / 4 * std::numbers::sqrt2, -0.2, 1e-12);
  EXPECT_NEAR((-u[0] - u[1] + u[2] + u[3]) / 4, 0.05, 1e-12);
  EXPECT_FALSE(motors.saturation.positive.any() || motors.saturation.negative.any());
}

TEST(Mixer, PrefersRollAndPitchToThrustAndThrustToYaw) {
  const MixedMotors full = mix(1.0, {0.3, 0, 0}, 0);
  EXPECT_NEAR((-full.commands[0] + full.commands[1] + full.commands[2] - full.commands[3]) / 4 * std::numbers::sqrt2, 0.3, 1e-12);
  const MixedMotors yaw = mix(0.9, {0, 0, 0.5}, 0);
  EXPECT_NEAR((yaw.commands[0] + yaw.commands[1] + yaw.commands[2] + yaw.commands[3]) / 4, 0.9, 1e-12);
  EXPECT_TRUE(yaw.saturation.positive[2]);
  for (const MixedMotors& m : {full, yaw, mix(0.0, {1, 1, 1}, 0), mix(1.0, {-1, 1, -1}, 1)})
    for (double c : m.commands) {
      EXPECT_GE(c, 0);
      EXPECT_LE(c, 1);
    }
}

TEST(Mixer, InvertsTheThrustCurve) {
  for (double factor : {0.0, 0.3, 1.0}) {
    const double c = mix(0.37, Vec3::Zero(), factor).commands[0];
    EXPECT_NEAR(factor * c * c + (1 - factor) * c, 0.37, 1e-12);
  }
}

TEST(ControlFilters, PassLowFrequenciesAndStopHighOnes) {
  const auto gain = [](double hz) {
    ButterworthFilter filter(1000, 40);
    double largest = 0;
    for (int i = 0; i < 4000; ++i) {
      const double y = filter(Vec3::Constant(std::sin(2 * std::numbers::pi * hz * i / 1000))).x();
      if (i > 2000) largest = std::max(largest, std::abs(y));
    }
    return largest;
  };
  EXPECT_NEAR(gain(2), 1, 0.01);
  EXPECT_NEAR(gain(40), std::numbers::sqrt2 / 2, 0.01);
  EXPECT_LT(gain(200), 0.05);
  ButterworthFilter constant(200, 30);
  EXPECT_NEAR(constant(Vec3(3, 0, 0)).x(), 3, 1e-12);  // starts in steady state
}

TEST(ControlOptions, AreWithinTheirRanges) { EXPECT_TRUE(validate(ControlOptions{})); }

}  // namespace controller_test
}  // namespace fbvins
