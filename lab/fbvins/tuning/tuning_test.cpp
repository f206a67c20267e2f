// SPDX-License-Identifier: Apache-2.0
// Tunes wrong gains from a flight of the simulated vehicle and judges the result on the vehicle itself, with its saturation,
// battery and noise, against the best gains that a search on the vehicle finds.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "fbvins/core/rng.hpp"
#include "fbvins/flight/closed_loop.hpp"
#include "fbvins/flight/excitation.hpp"
#include "fbvins/tuning/tune_report.hpp"

namespace fbvins {
namespace tuning_test {

constexpr double kRate_hz = 200;

/// A hovering vehicle, controlled by the cascade with its true state and noise.
class Hovering {
 public:
  explicit Hovering(const ControlOptions& control)
      : vehicle_(QuadrotorOptions{}, in_the_air()), controller_(control, kRate_hz), hover_(control.position.MPC_THR_HOVER) {
    setpoint_.p = Vec3(0, 0, 1.5);
  }
  void settle(double seconds) {
    for (int i = 0; i < seconds * kRate_hz; ++i) fly(setpoint_);
  }
  void fly(const PathSetpoint& setpoint) { go_on(controller_.fly(estimate(), setpoint)); }
  void lean(const Quat& q) {
    AttitudeSetpoint wanted;
    wanted.q_LV = q;
    wanted.thrust = hover_;
    go_on(controller_.hold(estimate(), wanted));
  }
  const ControlTrace& trace() const { return controller_.trace(); }
  const QuadrotorState& state() const { return vehicle_.state(); }
  VehicleEstimate estimate() {
    VehicleEstimate e;
    e.T_LV = {state().T_WV.q, state().T_WV.p};
    e.v_LV = state().v_WV + 0.005 * noise();
    e.w_LV_V = state().w_WV_V + 0.01 * noise();
    return e;
  }
  const PathSetpoint& hover() const { return setpoint_; }

 private:
  static QuadrotorState in_the_air() {
    QuadrotorState s = standing_at({0, 0}, 0, {});
    s.T_WV.p.z() = 1.5;
    s.rotor_radps.fill(500);
    return s;
  }
  Vec3 noise() {
    const double x = rng_.normal(), y = rng_.normal(), z = rng_.normal();
    return {x, y, z};
  }
  void go_on(const PerRotor& commands) {
    for (int i = 0; i < 5; ++i) vehicle_.step(commands, Vec3::Zero());
  }

  Quadrotor vehicle_;
  CascadeController controller_;
  Rng rng_{9};
  double hover_;
  PathSetpoint setpoint_;
};

LoopLog identify(const ControlOptions& control) {
  Hovering flight(control);
  flight.settle(3);
  LoopLog log;
  log.source = "test";
  log.rate_hz = kRate_hz;
  log.control = control;
  for (double t = 0; t < excitation_length_s(); t += 1 / kRate_hz) {
    const Vec3 v = flight.estimate().v_LV;
    flight.fly(excitation_setpoint(flight.hover(), t));
    log.rate.push_back(flight.trace().rate), log.torque.push_back(flight.trace().torque);
    log.velocity.push_back(v), log.acceleration_asked.push_back(flight.trace().a_setpoint);
  }
  return log;
}

/// Normalised step response of the vehicle itself.
StepResponse step_of(const ControlOptions& control, const std::string& loop) {
  Hovering flight(control);
  flight.settle(4);
  std::vector<double> y;
  const bool leans = loop == "roll" || loop == "pitch";
  const double size = leans ? 0.2 : loop == "yaw" ? 0.3 : 0.4, seconds = leans ? 1.0 : loop == "yaw" ? 3 : 8;
  PathSetpoint there = flight.hover();
  if (loop == "yaw") there.yaw_rad = size;
  if (loop == "xy") there.p.x() = size;
  if (loop == "z") there.p.z() += size;
  for (int i = 0; i < seconds * kRate_hz; ++i) {
    if (leans) flight.lean(so3_exp(size * (loop == "roll" ? Vec3::UnitX() : Vec3::UnitY())));
    else flight.fly(there);
    const QuadrotorState& s = flight.state();
    const Vec3 turned = so3_log(s.T_WV.q);
    y.push_back((loop == "roll"    ? turned.x()
                 : loop == "pitch" ? turned.y()
                 : loop == "yaw"   ? turned.z()
                 : loop == "xy"    ? s.T_WV.p.x()
                                   : s.T_WV.p.z() - 1.5) /
                size);
  }
  return judged(std::move(y), 1 / kRate_hz);
}

/// The four gains of a loop.
std::array<double*, 4> gains(ControlOptions& c, const std::string& loop) {
  if (loop == "roll") return {&c.rate.MC_ROLLRATE_P, &c.rate.MC_ROLLRATE_I, &c.rate.MC_ROLLRATE_D, &c.attitude.MC_ROLL_P};
  if (loop == "pitch") return {&c.rate.MC_PITCHRATE_P, &c.rate.MC_PITCHRATE_I, &c.rate.MC_PITCHRATE_D, &c.attitude.MC_PITCH_P};
  if (loop == "yaw") return {&c.rate.MC_YAWRATE_P, &c.rate.MC_YAWRATE_I, &c.rate.MC_YAWRATE_D, &c.attitude.MC_YAW_P};
  PositionControlOptions& p = c.position;
  if (loop == "xy") return {&p.MPC_XY_VEL_P_ACC, &p.MPC_XY_VEL_I_ACC, &p.MPC_XY_VEL_D_ACC, &p.MPC_XY_P};
  return {&p.MPC_Z_VEL_P_ACC, &p.MPC_Z_VEL_I_ACC, &p.MPC_Z_VEL_D_ACC, &p.MPC_Z_P};
}

const std::vector<std::string> kLoops{"roll", "pitch", "yaw", "xy", "z"};

ControlOptions wrong_by(double factor) {
  ControlOptions control = control_for(QuadrotorOptions{});
  for (const std::string& loop : kLoops)
    for (double* gain : gains(control, loop)) *gain *= factor;
  return control;
}

/// The shortest settling time within the allowed overshoot that a random search over the loop's gains, within PX4's ranges, finds
/// on the vehicle.
double best_settling_s(ControlOptions control, const std::string& loop, double overshoot) {
  Rng rng(5);
  double least = 1e9;
  const std::array<double*, 4> own = gains(control, loop);
  std::array<double, 4> best{};
  for (std::size_t i = 0; i < 4; ++i) best[i] = *own[i];
  for (int trial = 0; trial < 120; ++trial) {
    const double reach = trial < 60 ? 0.6 : 0.25;
    const std::array<GainRange, 4> ranges = px4_ranges(loop);
    for (std::size_t i = 0; i < 4; ++i)
      *own[i] = std::clamp(best[i] * (trial == 0 ? 1 : std::exp(reach * rng.normal())), ranges[i].least, ranges[i].most);
    const StepResponse s = step_of(control, loop);
    if (s.overshoot > overshoot || s.settling_s >= least) continue;
    least = s.settling_s;
    for (std::size_t i = 0; i < 4; ++i) best[i] = *own[i];
  }
  return least;
}

TEST(FrequencyResponse, OfAKnownLagWithADelay) {
  Rng rng(2);
  std::vector<double> u, y;
  double state = 0;
  for (int i = 0; i < 8000; ++i) {
    u.push_back(rng.normal());
    state += (1 - std::exp(-0.005 / 0.05)) * ((i >= 4 ? u[static_cast<std::size_t>(i - 4)] : 0) - state);
    y.push_back(2 * state + 0.001 * i);
  }
  for (const FrequencyPoint& p : frequency_response(u, y, 200, {1, 3, 6})) {
    const double w = 2 * std::numbers::pi * p.hz;
    const Complex wanted = 2.0 * std::polar(1.0, -w * 0.0175) / (1.0 + Complex(0, w * 0.05));
    EXPECT_LT(std::abs(p.H / wanted - 1.0), 0.06) << p.hz;
    EXPECT_GT(p.coherence, 0.9);
  }
}

TEST(LoopModel, MarginsOfKnownLoops) {
  const StabilityMargins integrator = margins_of([](double w) { return Complex(0, -10 / w); });
  EXPECT_NEAR(integrator.phase_deg, 90, 1e-6);
  EXPECT_NEAR(integrator.crossover_hz, 10 / (2 * std::numbers::pi), 0.05);
  const StabilityMargins late = margins_of([](double w) { return Complex(0, -10 / w) * std::polar(1.0, -0.05 * w); });
  EXPECT_NEAR(late.phase_deg, 90 - 0.5 * 180 / std::numbers::pi, 0.5);
  EXPECT_NEAR(late.gain, std::numbers::pi / 2 / 0.5, 0.05);
  EXPECT_LT(margins_of([](double w) { return Complex(0, -100 / w) * std::polar(1.0, -0.05 * w); }).gain, 1);
}

TEST(PlantFit, FindsTheVehiclesParameters) {
  const QuadrotorOptions vehicle;
  const Result<VehicleFit> fit = fit_vehicle(identify(control_for(vehicle)));
  ASSERT_TRUE(fit) << fit.error().message;
  // A full roll torque changes each rotor's thrust by 1/sqrt(2) of full thrust, on arms of arm_y.
  const double full_N = vehicle.thrust_N_per_radps2 * std::pow(vehicle.rotor_max_radps, 2);
  const double roll = 4 / std::numbers::sqrt2 * full_N * vehicle.arm_y_m / vehicle.inertia_x_kgm2;
  EXPECT_NEAR(fit->rate[0].plant.gain / roll, 1, 0.25);
  // Rotors lag by 30 to 45 ms, and the command is held for 5 ms.
  const double late_s = fit->rate[0].plant.lag_s + fit->rate[0].plant.delay_s;
  EXPECT_GT(late_s, 0.03);
  EXPECT_LT(late_s, 0.06);
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(fit->velocity[static_cast<std::size_t>(axis)].plant.gain, 1, 0.2) << axis;
}

class FromWrongGains : public testing::TestWithParam<double> {};

TEST_P(FromWrongGains, TwoRoundsLeadToGoodOnes) {
  ControlOptions control = wrong_by(GetParam());
  const TuneOptions options;
  for (int round = 0; round < 2; ++round) {
    const LoopLog log = identify(control);
    const Result<VehicleFit> fit = fit_vehicle(log);
    ASSERT_TRUE(fit) << fit.error().message;
    const Tuning tuning = tune(log, *fit, options);
    control = tuning.proposed;
    for (const LoopTuning& loop : tuning.loops) EXPECT_TRUE(loop.reachable) << loop.name;
  }
  for (const std::string& loop : kLoops) {
    const StepResponse s = step_of(control, loop);
    static std::map<std::string, double> found;  // by loop; independent of the initial gains
    if (!found.contains(loop)) found[loop] = best_settling_s(control, loop, 0.10);
    const double best_s = found[loop];
    std::printf("%s: %.0f %% over, settled after %.2f s, best found %.2f s\n", loop.c_str(), 100 * s.overshoot, s.settling_s,
                best_s);
    EXPECT_LE(s.overshoot, 0.10) << loop;
    EXPECT_LE(s.settling_s, 1.2 * best_s) << loop;
  }
}

INSTANTIATE_TEST_SUITE_P(Gains, FromWrongGains, testing::Values(0.4, 2.5));

}  // namespace tuning_test
}  // namespace fbvins
