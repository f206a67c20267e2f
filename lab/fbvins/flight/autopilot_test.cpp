// SPDX-License-Identifier: Apache-2.0
// The autopilot with a vehicle that moves and an IMU that errs, on an odometry made of the truth: what happens when that fails.
#include "fbvins/flight/autopilot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>

#include "fbvins/flight/closed_loop.hpp"
#include "fbvins/sim/barometer.hpp"
#include "fbvins/sim/imu_errors.hpp"
#include "fbvins/sim/rotor_shake.hpp"

namespace fbvins {
namespace {

constexpr double kDelay_s = 0.03;

/// What the odometry says of an image, or nothing.
using Told = std::function<std::optional<Odometry>(double t_s, Odometry honest)>;

struct Outcome {
  std::vector<FlightRow> rows;
  FlightMode mode;
  FlightReason reason;
  Vec3 last_p;
  double largest(double from_s, double to_s, const std::function<double(const FlightRow&)>& value) const {
    double most = 0;
    for (const FlightRow& r : rows)
      if (r.t_s > from_s && r.t_s < to_s) most = std::max(most, value(r));
    return most;
  }
  bool was(FlightMode wanted) const {
    return std::any_of(rows.begin(), rows.end(), [&](const FlightRow& r) { return r.autopilot.mode == wanted; });
  }
};

/// The odometry's W: turned and moved against the world, and tilted by what a bias of the accelerometer looks like.
Odometry honest_odometry(const Quadrotor& vehicle, const Pose<BodyFlu, B>& mounting, const ImuBias& bias,
                         const Pose<W, W>& T_WoW) {
  const MotionState m = vehicle.motion_of(mounting);
  Odometry o;
  o.T_WB = T_WoW * m.T_WB;
  o.v_WB = T_WoW.q * m.v_WB;
  o.bias = bias;
  o.health = {HealthState::good, HealthReason::none};
  o.pose_covariance = 1e-6 * Mat6::Identity();
  return o;
}

Outcome fly_mission(const std::string& text, const Told& told, double seconds = 40, double tilt_rad = 0) {
  const Mission mission = *parse_mission(text, "m.yaml");
  const StereoRig rig = euroc_rig();
  const Pose<BodyFlu, B> mounting = imu_mounting(rig, 5);
  const QuadrotorOptions options;
  Quadrotor vehicle(options, standing_at({1, 2}, 0.6, options));
  const Pose<W, BodyFlu> start = vehicle.state().T_WV;
  Autopilot autopilot(mission, control_for(options), rig, mounting);
  ImuErrors imu(rig.imu_noise, {}, 5);
  RotorShake shake(5);
  Wind wind({}, 5);
  Barometer barometer({}, 5);
  std::deque<std::pair<double, Odometry>> waiting;
  PerRotor commands{};
  Outcome out;
  for (int step = 0; step < seconds * 1000 && autopilot.output().mode != FlightMode::landed; ++step) {
    const double t = step * 1e-3;
    if (step % 50 == 25) {
      ImuBias believed = imu.bias();
      believed.accel_mps2 += mounting.q.conjugate() * Vec3(kSimGravity_mps2 * std::sin(tilt_rad), 0, 0);
      // The tilt of W is about the axis to the left of the vehicle that stood there.
      const Quat tilt = start.q * so3_exp(Vec3(0, tilt_rad, 0)) * start.q.conjugate();
      Odometry o =
          honest_odometry(vehicle, mounting, believed, {(so3_exp(Vec3(0, 0, 1.1)) * tilt).normalized(), Vec3(3, -1, 0.4)});
      if (tilt_rad != 0) o.pose_covariance.block<3, 3>(3, 3) = 4e-4 * Mat3::Identity();
      o.t = Time{static_cast<std::int64_t>(step) * 1'000'000};
      if (std::optional<Odometry> said = told(t, o)) waiting.emplace_back(t + kDelay_s, *said);
    }
    if (step % 5 == 0) {
      for (; !waiting.empty() && waiting.front().first <= t; waiting.pop_front()) autopilot.add(waiting.front().second);
      if (step % 20 == 0) autopilot.add_barometer(barometer.read(vehicle.state().T_WV.p.z()));
      PerRotor shares = vehicle.state().rotor_radps;
      for (double& w : shares) w /= 503;
      const Time stamp{static_cast<std::int64_t>(step) * 1'000'000};
      commands = autopilot.update(imu.read(stamp, vehicle.motion_of(mounting), shake.step(shares, 0.005)));
      FlightRow row;
      row.t_s = t;
      row.truth = (start.inverse() * vehicle.state().T_WV).cast_frames<Local, BodyFlu>();
      row.true_velocity = start.q.conjugate() * vehicle.state().v_WV;
      row.autopilot = autopilot.output();
      out.rows.push_back(row);
    }
    vehicle.step(commands, wind.step(1e-3, vehicle.state().T_WV.p.z()));
  }
  out.mode = autopilot.output().mode;
  out.reason = autopilot.output().reason;
  out.last_p = out.rows.back().truth.p;
  return out;
}

std::optional<Odometry> always(double, Odometry o) { return o; }

constexpr const char* kUpAndOver = "steps:\n  - takeoff: 0.6\n  - hold: 1\n  - goto: [0.6, 0.3, 0.6]\n  - hold: 6\n  - land\n";

TEST(Autopilot, FliesAMissionWhereverTheOdometryBegan) {
  const Outcome flight = fly_mission(kUpAndOver, always);
  EXPECT_EQ(flight.mode, FlightMode::landed);
  EXPECT_EQ(flight.reason, FlightReason::none);
  EXPECT_LT(flight.largest(12, 14, [](const FlightRow& r) { return (r.truth.p - Vec3(0.6, 0.3, 0.6)).norm(); }), 0.06);
  EXPECT_LT((flight.last_p - Vec3(0.6, 0.3, 0)).norm(), 0.08);
}

TEST(Autopilot, TheFloorLevelsAnOdometryThatIsNotSureOfUp) {
  const Outcome flight = fly_mission(kUpAndOver, always, 40, 0.04);
  EXPECT_EQ(flight.mode, FlightMode::landed);
  EXPECT_LT(flight.largest(3, 14, [](const FlightRow& r) { return (r.autopilot.estimate.T_LV.p - r.truth.p).norm(); }), 0.012);
}

TEST(Autopilot, HoldsWhenTheOdometryIsSilentForASecond) {
  const Outcome flight =
      fly_mission(kUpAndOver, [](double t, const Odometry& o) { return t > 7 && t < 8 ? std::nullopt : std::optional(o); });
  EXPECT_TRUE(flight.was(FlightMode::holding));
  EXPECT_FALSE(flight.was(FlightMode::descending));
  EXPECT_EQ(flight.mode, FlightMode::landed);
  EXPECT_EQ(flight.reason, FlightReason::none);
  EXPECT_LT((flight.last_p - Vec3(0.6, 0.3, 0)).norm(), 0.08);
}

TEST(Autopilot, ComesDownWhenTheOdometryIsGone) {
  const Outcome flight =
      fly_mission(kUpAndOver, [](double t, const Odometry& o) { return t > 8 ? std::nullopt : std::optional(o); });
  EXPECT_TRUE(flight.was(FlightMode::descending));
  EXPECT_EQ(flight.mode, FlightMode::landed);
  EXPECT_EQ(flight.reason, FlightReason::lost);
  EXPECT_LT(flight.last_p.z(), 0.02);
  EXPECT_LT(flight.last_p.head<2>().norm(), 1.5);  // where it was, and what the wind makes of a few seconds
  for (const FlightRow& r : flight.rows) EXPECT_LT(r.true_velocity.norm(), 1.2);
}

TEST(Autopilot, ComesDownWhenTheOdometrySaysThatItIsLost) {
  const Outcome flight = fly_mission(kUpAndOver, [](double t, Odometry o) {
    if (t > 8) o.health = {HealthState::lost, HealthReason::no_tracks};
    return std::optional(o);
  });
  EXPECT_TRUE(flight.was(FlightMode::descending));
  EXPECT_EQ(flight.mode, FlightMode::landed);
  EXPECT_LT(flight.last_p.z(), 0.02);
}

TEST(Autopilot, ARestartElsewhereMovesNothing) {
  const Outcome flight = fly_mission(kUpAndOver, [](double t, Odometry o) {
    if (t > 8) {  // a new W: another origin, another heading
      const Pose<W, W> moved{so3_exp(Vec3(0, 0, 2)), Vec3(10, -4, 2)};
      o.T_WB = moved * o.T_WB;
      o.v_WB = moved.q * o.v_WB;
      o.reset_counter = 1;
    }
    return std::optional(o);
  });
  EXPECT_TRUE(flight.was(FlightMode::holding));
  EXPECT_EQ(flight.mode, FlightMode::landed);
  EXPECT_LT((flight.last_p - Vec3(0.6, 0.3, 0)).norm(), 0.12);
}

TEST(Autopilot, StaysOnTheGroundWithoutAPose) {
  const Outcome flight = fly_mission(kUpAndOver, [](double, const Odometry&) { return std::optional<Odometry>(); });
  EXPECT_EQ(flight.mode, FlightMode::landed);
  EXPECT_EQ(flight.reason, FlightReason::no_pose);
  EXPECT_LT(flight.last_p.norm(), 1e-3);
}

TEST(InertialReference, KnowsHowFastItClimbsByBarometerAndImu) {
  const Pose<BodyFlu, B> mounting;
  InertialReference reference(mounting);
  VehicleEstimate known;
  known.T_LV.p = Vec3(0, 0, 1);
  ImuErrors imu(ImuNoise{}, {}, 3);
  Barometer barometer({}, 3);
  double z = 1, v = 0, worst = 0;
  for (int k = 0; k < 200 * 40; ++k) {
    const double t = k / 200.0, a = t > 10 ? 0.5 * std::sin(t) : 0;
    MotionState m;
    m.a_WB = Vec3(0, 0, a);
    const ImuSample reading = imu.read(Time{static_cast<std::int64_t>(k) * 5'000'000}, m, {});
    reference.predict(reading, 0.005);
    z += 0.005 * v;
    v += 0.005 * a;
    if (t < 10) {
      known.T_LV.p.z() = z;
      reference.follow(known, imu.bias());
    }
    if (k % 4 == 0) reference.correct(barometer.read(z));
    if (t > 12) worst = std::max(worst, std::abs(reference.estimate().v_LV.z() - v));
  }
  EXPECT_LT(worst, 0.2);
  EXPECT_GT((reference.estimate().T_LV.q * Vec3::UnitZ()).z(), 0.999);
}

}  // namespace
}  // namespace fbvins
