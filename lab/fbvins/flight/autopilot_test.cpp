// SPDX-License-Identifier: Apache-2.0
// The autopilot with a simulated vehicle, an IMU with errors and an odometry that is the ground truth with induced faults.
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
namespace autopilot_test {

constexpr double kDelay_s = 0.03;

/// The odometry's answer to an image, or nothing.
using Told = std::function<std::optional<Odometry>(double t_s, Odometry truth)>;

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

/// True odometry in a W that is rotated, moved and tilted (as by an accelerometer bias) with respect to the world.
Odometry true_odometry(const Quadrotor& vehicle, const Pose<BodyFlu, B>& mounting, const ImuBias& bias, const Pose<W, W>& T_WoW) {
  const MotionState m = vehicle.motion_of(mounting);
  Odometry o;
  o.T_WB = T_WoW * m.T_WB;
  o.v_WB = T_WoW.q * m.v_WB;
  o.bias = bias;
  o.health = {HealthState::good, HealthReason::none};
  o.pose_covariance = 1e-6 * Mat6::Identity();
  return o;
}

struct Circumstances {
  double seconds = 40;
  QuadrotorState start = standing_at({1, 2}, 0.6, {});
  std::string vehicle = "indoor330";
  int seed = 5;
};

Outcome fly_mission(const Mission& mission, const Told& told, const Circumstances& in = {}) {
  const auto seed = static_cast<std::uint64_t>(in.seed);
  const StereoRig rig = euroc_rig();
  const Pose<BodyFlu, B> mounting = imu_mounting(rig, 5);
  const QuadrotorOptions options = *quadrotor_preset(in.vehicle);
  Quadrotor vehicle(options, in.start);
  const Pose<W, BodyFlu> start = vehicle.state().T_WV;
  Autopilot autopilot(mission, control_for(options), rig, mounting);
  ImuErrors imu(rig.imu_noise, {}, seed);
  RotorShake shake(seed);
  Wind wind({}, seed);
  Barometer barometer({}, seed);
  const double hover_radps = std::sqrt(options.mass_kg * kSimGravity_mps2 / (4 * options.thrust_N_per_radps2));
  std::deque<std::pair<double, Odometry>> waiting;
  PerRotor commands{};
  Outcome out;
  for (int step = 0; step < in.seconds * 1000 && autopilot.output().mode != FlightMode::landed; ++step) {
    const double t = step * 1e-3;
    if (step % 50 == 25) {
      Odometry o = true_odometry(vehicle, mounting, imu.bias(), {so3_exp(Vec3(0, 0, 1.1)), Vec3(3, -1, 0.4)});
      o.t = Time{static_cast<std::int64_t>(step) * 1'000'000};
      if (std::optional<Odometry> said = told(t, o)) waiting.emplace_back(t + kDelay_s, *said);
    }
    if (step % 5 == 0) {
      for (; !waiting.empty() && waiting.front().first <= t; waiting.pop_front()) autopilot.add(waiting.front().second);
      if (step % 20 == 0) autopilot.add_barometer(barometer.read(vehicle.state().T_WV.p.z()));
      PerRotor shares = vehicle.state().rotor_radps;
      for (double& w : shares) w /= hover_radps;
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

/// Flies a mission of configs/missions without its faults and without images, and expects no collision.
Outcome fly_shipped(const std::string& name, const Circumstances& circumstances) {
  Mission mission = *read_mission(FBVINS_MISSIONS "/" + name + ".yaml");
  mission.faults.clear();
  Circumstances in = circumstances;
  in.start = standing_at(mission.place.start_m, mission.place.heading_rad, *quadrotor_preset(in.vehicle));
  const Result<MissionSite> site = site_of(mission, {}, in.start.T_WV.p.z());
  EXPECT_TRUE(site) << site.error().message;
  std::vector<Vec3> path;
  for (const MissionPoint& place : path_points(mission)) path.push_back(site->to_world(place.p));
  const World world = build_world({}, site->plan, path, static_cast<std::uint64_t>(in.seed));
  const CollisionCheck check(world, {});
  Outcome flight = fly_mission(mission, always, in);
  for (std::size_t i = 0; i < flight.rows.size(); i += 10) {
    const std::optional<Vec3> place = check.touched_at(in.start.T_WV * flight.rows[i].truth.p);
    EXPECT_FALSE(place) << name << " collides after " << flight.rows[i].t_s << " s";
    if (place) break;
  }
  EXPECT_EQ(flight.mode, FlightMode::landed) << name;
  EXPECT_EQ(flight.reason, FlightReason::none) << name;
  return flight;
}

constexpr const char* kUpAndOver = "steps:\n  - takeoff: 0.6\n  - hold: 1\n  - goto: [0.6, 0.3, 0.6]\n  - hold: 6\n  - land\n";

TEST(Autopilot, FliesAMissionWhereverTheOdometryBegan) {
  const Outcome flight = fly_mission(*parse_mission(kUpAndOver, "m.yaml"), always);
  EXPECT_EQ(flight.mode, FlightMode::landed);
  EXPECT_EQ(flight.reason, FlightReason::none);
  EXPECT_LT(flight.largest(12, 14, [](const FlightRow& r) { return (r.truth.p - Vec3(0.6, 0.3, 0.6)).norm(); }), 0.06);
  EXPECT_LT((flight.last_p - Vec3(0.6, 0.3, 0)).norm(), 0.08);
}

TEST(Autopilot, HoldsWhenTheOdometryIsSilentForASecond) {
  const Outcome flight = fly_mission(*parse_mission(kUpAndOver, "m.yaml"), [](double t, const Odometry& o) {
    return t > 7 && t < 8 ? std::nullopt : std::optional(o);
  });
  EXPECT_TRUE(flight.was(FlightMode::holding));
  EXPECT_FALSE(flight.was(FlightMode::descending));
  EXPECT_EQ(flight.mode, FlightMode::landed);
  EXPECT_EQ(flight.reason, FlightReason::none);
  EXPECT_LT((flight.last_p - Vec3(0.6, 0.3, 0)).norm(), 0.08);
}

TEST(Autopilot, ComesDownWhenTheOdometryIsGone) {
  const Outcome flight = fly_mission(*parse_mission(kUpAndOver, "m.yaml"),
                                     [](double t, const Odometry& o) { return t > 8 ? std::nullopt : std::optional(o); });
  EXPECT_TRUE(flight.was(FlightMode::descending));
  EXPECT_EQ(flight.mode, FlightMode::landed);
  EXPECT_EQ(flight.reason, FlightReason::lost);
  EXPECT_LT(flight.last_p.z(), 0.02);
  EXPECT_LT(flight.last_p.head<2>().norm(), 1.5);  // the wind's drift of a few seconds
  for (const FlightRow& r : flight.rows) EXPECT_LT(r.true_velocity.norm(), 1.2);
}

TEST(Autopilot, ComesDownWhenTheOdometrySaysThatItIsLost) {
  const Outcome flight = fly_mission(*parse_mission(kUpAndOver, "m.yaml"), [](double t, Odometry o) {
    if (t > 8) o.health = {HealthState::lost, HealthReason::no_tracks};
    return std::optional(o);
  });
  EXPECT_TRUE(flight.was(FlightMode::descending));
  EXPECT_EQ(flight.mode, FlightMode::landed);
  EXPECT_LT(flight.last_p.z(), 0.02);
}

TEST(Autopilot, ARestartElsewhereMovesNothing) {
  const Outcome flight = fly_mission(*parse_mission(kUpAndOver, "m.yaml"), [](double t, Odometry o) {
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
  const Outcome flight =
      fly_mission(*parse_mission(kUpAndOver, "m.yaml"), [](double, const Odometry&) { return std::optional<Odometry>(); });
  EXPECT_EQ(flight.mode, FlightMode::landed);
  EXPECT_EQ(flight.reason, FlightReason::no_pose);
  EXPECT_LT(flight.last_p.norm(), 1e-3);
}

TEST(Autopilot, TheShippedMissionsAreFreeOfCollisions) {
  for (int seed : {1, 2, 3}) {
    const Outcome paper = fly_shipped("paper", {.seconds = 60, .seed = seed});
    EXPECT_LT((paper.last_p - Vec3(0.6, 0.3, 0)).norm(), 0.1);
    (void)fly_shipped("odometry_stops", {.seconds = 90, .seed = seed});
  }
  const Outcome tour = fly_shipped("tour", {.seconds = 420});
  EXPECT_LT(tour.last_p.norm(), 0.1);
  EXPECT_GT(tour.rows.back().t_s, 240);
}

TEST(Autopilot, FliesAtThreeMetresASecond) {
  const Outcome fast = fly_shipped("fast", {.seconds = 90});
  EXPECT_LT(fast.last_p.norm(), 0.15);
  EXPECT_GT(fast.largest(0, 90, [](const FlightRow& r) { return r.true_velocity.norm(); }), 2.5);
  EXPECT_LT(
      fast.largest(4, fast.rows.back().t_s - 5, [](const FlightRow& r) { return (r.truth.p - r.autopilot.setpoint.p).norm(); }),
      0.4);
}

TEST(Autopilot, FliesTheQuadrotorOfSihToo) {
  const Outcome sih = fly_shipped("paper", {.seconds = 60, .vehicle = "sih"});
  EXPECT_LT((sih.last_p - Vec3(0.6, 0.3, 0)).norm(), 0.25);
}

TEST(InertialReference, EstimatesVerticalSpeedFromBarometerAndImu) {
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

}  // namespace autopilot_test
}  // namespace fbvins
