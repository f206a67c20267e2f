// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/quadrotor.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/core/options.hpp"
#include "fbvins/sim/wind.hpp"

namespace fbvins {
namespace quadrotor_test {

constexpr double g = kSimGravity_mps2;

QuadrotorOptions without_air() {
  QuadrotorOptions o;
  o.rotor_drag_Ns2_per_rad_m = o.drag_Ns2_per_m2 = o.drag_Ns_per_m = o.angular_drag_Nms = 0;
  o.ground_effect = false;
  o.battery_resistance_ohm = 0;
  o.battery_empty_V = o.battery_full_V;
  return o;
}

QuadrotorState in_the_air(double height_m = 100) {
  QuadrotorState s;
  s.T_WV.p = Vec3(0, 0, height_m);
  return s;
}

PerRotor all(double x) { return {x, x, x, x}; }

void run(Quadrotor& vehicle, const PerRotor& commands, double seconds, const Vec3& wind = Vec3::Zero()) {
  for (int i = 0; i < std::lround(seconds / Quadrotor::kStep_s); ++i) vehicle.step(commands, wind);
}

double hover_radps(const QuadrotorOptions& o) { return std::sqrt(o.mass_kg * g / (4 * o.thrust_N_per_radps2)); }

TEST(Quadrotor, FallsFreely) {
  const QuadrotorOptions o = without_air();
  Quadrotor vehicle(o, in_the_air());
  run(vehicle, all(0), 2);
  EXPECT_NEAR(vehicle.state().T_WV.p.z(), 100 - 0.5 * g * 4, 1e-9);
  EXPECT_NEAR(vehicle.state().v_WV.z(), -2 * g, 1e-9);
  EXPECT_LT(vehicle.motion_of({}).specific_force().norm(), 1e-9);  // an accelerometer in free fall reads zero
}

TEST(Quadrotor, HoversAtTheThrustThatCarriesIt) {
  for (const std::string& name : quadrotor_presets()) {
    QuadrotorOptions o = *quadrotor_preset(name);
    ASSERT_TRUE(validate(o)) << name;
    o.battery_resistance_ohm = 0;
    o.battery_empty_V = o.battery_full_V;
    QuadrotorState s = in_the_air();
    s.rotor_radps = all(hover_radps(o));
    Quadrotor vehicle(o, s);
    const double share = hover_radps(o) / o.rotor_max_radps;
    run(vehicle, all(o.command_is_thrust ? share * share : share), 5);
    EXPECT_NEAR(vehicle.state().T_WV.p.z(), 100, 1e-3) << name;
    EXPECT_NEAR(vehicle.motion_of({}).specific_force().z(), g, 1e-3) << name;
  }
}

TEST(Quadrotor, ThrustToWeightIsOneThatFlies) {
  for (const std::string& name : quadrotor_presets()) {
    const QuadrotorOptions o = *quadrotor_preset(name);
    const double ratio = 4 * o.thrust_N_per_radps2 * o.rotor_max_radps * o.rotor_max_radps / (o.mass_kg * g);
    EXPECT_GT(ratio, 1.8) << name;
    EXPECT_LT(ratio, 4.0) << name;
  }
  EXPECT_FALSE(quadrotor_preset("airship"));
}

TEST(Quadrotor, RotorsLagByTheirTimeConstants) {
  QuadrotorOptions o = without_air();
  Quadrotor vehicle(o, in_the_air());
  run(vehicle, all(0.5), o.spin_up_s);
  EXPECT_NEAR(vehicle.state().rotor_radps[0], 0.5 * o.rotor_max_radps * (1 - std::exp(-1.0)), 0.1);
  run(vehicle, all(2.0), 1);  // commands above 1 count as 1
  EXPECT_NEAR(vehicle.state().rotor_radps[0], o.rotor_max_radps, 1e-3);
  run(vehicle, all(0), o.spin_down_s);
  EXPECT_NEAR(vehicle.state().rotor_radps[0], o.rotor_max_radps * std::exp(-1.0), 0.1);
}

TEST(Quadrotor, YawTorqueIsTheDifferenceOfTheRotors) {
  QuadrotorOptions o = without_air();
  o.rotor_inertia_kgm2 = 0;
  QuadrotorState s = in_the_air();
  const double fast = 520, slow = 480;
  s.rotor_radps = {fast, fast, slow, slow};
  Quadrotor vehicle(o, s);
  const double torque = -2 * o.torque_per_thrust_m * o.thrust_N_per_radps2 * (fast * fast - slow * slow);
  EXPECT_NEAR(vehicle.motion_of({}).dw_WB_B.z(), torque / o.inertia_z_kgm2, 1e-9);  // counter-clockwise rotors push clockwise
  EXPECT_LT(vehicle.motion_of({}).dw_WB_B.head<2>().norm(), 1e-9);
}

TEST(Quadrotor, EachRotorTiltsTheVehicleByItsPosition) {
  const QuadrotorOptions o = without_air();
  const Vec2 wanted[] = {{-1, -1}, {1, 1}, {1, -1}, {-1, 1}};  // sign of roll and pitch in V, y to the left
  for (int i = 0; i < kRotors; ++i) {
    QuadrotorState s = in_the_air();
    s.rotor_radps[static_cast<std::size_t>(i)] = 500;
    const Vec3 dw = Quadrotor(o, s).motion_of({}).dw_WB_B;
    EXPECT_GT(dw.x() * wanted[i].x(), 1) << i;
    EXPECT_GT(dw.y() * wanted[i].y(), 1) << i;
  }
}

TEST(Quadrotor, TumblingKeepsEnergyAndAngularMomentum) {
  QuadrotorOptions o = without_air();
  o.rotor_inertia_kgm2 = 0;
  QuadrotorState s = in_the_air();
  s.w_WV_V = Vec3(0.3, 4, 7);
  const Vec3 inertia(o.inertia_x_kgm2, o.inertia_y_kgm2, o.inertia_z_kgm2);
  const auto energy = [&](const QuadrotorState& x) {
    return 0.5 * x.w_WV_V.dot(inertia.cwiseProduct(x.w_WV_V)) + 0.5 * o.mass_kg * x.v_WV.squaredNorm() +
           o.mass_kg * g * x.T_WV.p.z();
  };
  const auto momentum = [&](const QuadrotorState& x) { return Vec3(x.T_WV.q * inertia.cwiseProduct(x.w_WV_V)); };
  Quadrotor vehicle(o, s);
  run(vehicle, all(0), 3);
  EXPECT_NEAR(energy(vehicle.state()), energy(s), 1e-6 * energy(s));
  EXPECT_LT((momentum(vehicle.state()) - momentum(s)).norm(), 1e-6 * momentum(s).norm());
  EXPECT_NEAR(vehicle.state().T_WV.q.norm(), 1, 1e-12);
}

TEST(Quadrotor, FallsNoFasterThanDragAllows) {
  QuadrotorOptions o = without_air();
  o.drag_Ns2_per_m2 = 0.1;
  Quadrotor vehicle(o, in_the_air(2000));
  run(vehicle, all(0), 20);
  EXPECT_NEAR(vehicle.state().v_WV.z(), -std::sqrt(o.mass_kg * g / o.drag_Ns2_per_m2), 1e-3);
}

TEST(Quadrotor, DriftsWithTheWind) {
  QuadrotorOptions o = without_air();
  o.rotor_drag_Ns2_per_rad_m = 5e-4;
  QuadrotorState s = in_the_air();
  s.rotor_radps = all(hover_radps(o));
  Quadrotor vehicle(o, s);
  const Vec3 wind(1, -0.5, 0);
  const double rate = 4 * o.rotor_drag_Ns2_per_rad_m * hover_radps(o) / o.mass_kg;
  run(vehicle, all(hover_radps(o) / o.rotor_max_radps), 1, wind);
  EXPECT_NEAR(vehicle.state().v_WV.x(), wind.x() * (1 - std::exp(-rate)), 1e-3);
  EXPECT_NEAR(vehicle.state().v_WV.y(), wind.y() * (1 - std::exp(-rate)), 1e-3);
}

TEST(Quadrotor, TheFloorAddsLiftAndCarriesTheLegs) {
  QuadrotorOptions o = without_air();
  o.ground_effect = true;
  const auto lift = [&](double height) {
    QuadrotorState s = in_the_air(height);
    s.rotor_radps = all(hover_radps(o));
    return Quadrotor(o, s).motion_of({}).specific_force().z() / g;
  };
  const double ratio = o.rotor_radius_m / (4 * 0.3);
  EXPECT_NEAR(lift(0.3), 1 / (1 - ratio * ratio), 1e-9);
  EXPECT_NEAR(lift(5), 1, 1e-4);

  Quadrotor vehicle(o, standing_at({1, 2}, 0.7, o));
  const Vec3 before = vehicle.state().T_WV.p;
  run(vehicle, all(0), 5, Vec3(3, 0, 0));
  EXPECT_LT((vehicle.state().T_WV.p - before).norm(), 1e-9);
  EXPECT_TRUE(vehicle.on_ground());
  EXPECT_NEAR(vehicle.motion_of({}).specific_force().z(), g, 1e-9);
}

TEST(Quadrotor, DropsOnItsLegsAndComesToRest) {
  QuadrotorOptions o;
  QuadrotorState s = standing_at({0, 0}, 0, o);
  s.T_WV.p.z() += 0.1;
  s.v_WV.x() = 0.3;
  Quadrotor vehicle(o, s);
  run(vehicle, all(0), 3);
  EXPECT_LT(vehicle.state().v_WV.norm(), 1e-3);
  EXPECT_NEAR(vehicle.state().T_WV.p.z(), o.leg_m, 2e-3);
  EXPECT_GT((vehicle.state().T_WV.q * Vec3::UnitZ()).z(), 0.9999);
}

TEST(Quadrotor, BatterySagsUnderLoadAndEmpties) {
  QuadrotorOptions o;
  QuadrotorState s = in_the_air(1000);
  s.rotor_radps = all(hover_radps(o));
  Quadrotor vehicle(o, s);
  run(vehicle, all(0.7), 1);
  const double under_load = vehicle.battery_V();
  EXPECT_LT(under_load, o.battery_full_V - 0.1);
  EXPECT_LT(vehicle.state().rotor_radps[0], 0.7 * o.rotor_max_radps);  // speed falls with voltage
  run(vehicle, all(0.7), 20);
  EXPECT_LT(vehicle.battery_V(), under_load);
}

TEST(Quadrotor, MotionOffTheCentreIncludesTheLeverArm) {
  QuadrotorState s = in_the_air();
  s.w_WV_V = Vec3(0, 0, 5);
  const Pose<BodyFlu, B> mounting{Quat::Identity(), Vec3(0.1, 0, 0)};
  const MotionState m = Quadrotor(without_air(), s).motion_of(mounting);
  EXPECT_NEAR(m.v_WB.y(), 0.5, 1e-12);
  EXPECT_NEAR(m.a_WB.x(), -0.1 * 25, 1e-9);
}

TEST(Wind, HasTheStrengthOfItsOptions) {
  WindOptions o{.mean_mps = 0, .gust_mps = 0.5, .gust_s = 0.5};
  Wind wind(o, 3);
  Vec3 squares = Vec3::Zero();
  const int n = 400'000;
  for (int i = 0; i < n; ++i) squares += wind.step(0.01, 2).cwiseAbs2();
  EXPECT_NEAR(std::sqrt(squares.head<2>().sum() / n), 0.5 * std::sqrt(2.0), 0.02);
  EXPECT_NEAR(std::sqrt(squares.z() / n), 0.25, 0.01);
  EXPECT_EQ(wind.step(0.01, 0), Vec3(0, 0, 0));  // none at the floor
  o = {.mean_mps = 2, .gust_mps = 0, .gust_s = 1};
  EXPECT_NEAR(Wind(o, 5).step(0.01, 2).norm(), 2, 1e-12);
  EXPECT_NE(Wind(o, 5).step(0.01, 2), Wind(o, 6).step(0.01, 2));
}

}  // namespace quadrotor_test
}  // namespace fbvins
