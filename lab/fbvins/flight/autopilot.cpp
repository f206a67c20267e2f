// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/autopilot.hpp"

#include <cmath>

#include "fbvins/estimator/estimator_setup.hpp"

namespace fbvins {
namespace {

constexpr double kSmoothing_s = 0.1;  ///< the default of `fbvins live`
/// The rotors idle for this long at this command before the vehicle climbs.
constexpr double kSpool_s = 1.0, kIdle = 0.12;
constexpr double kDescent_mps = 0.4;
// On the ground: vertical speed below kStill_mps and thrust below this share of hover thrust, for kStill_s.
constexpr double kCarried = 0.6, kStill_mps = 0.15, kStill_s = 0.5;

double heading(const Quat& q) {
  const Vec3 nose = q * Vec3::UnitX();
  return std::atan2(nose.y(), nose.x());
}

}  // namespace

Autopilot::Autopilot(const Mission& mission, const ControlOptions& options, const StereoRig& rig,
                     const Pose<BodyFlu, B>& mounting)
    : mounting_(mounting),
      rate_hz_(rig.imu_noise.rate_hz),
      fence_(fence_of(mission)),
      options_(options),
      propagator_(assumed_noise(rig.imu_noise, EstimatorOptions{}), Duration::from_seconds(rig.time_offset_s), kSmoothing_s),
      controller_(options, rate_hz_),
      guide_(mission, rate_hz_),
      reference_(mounting) {}

void Autopilot::add(const Odometry& odometry) {
  propagator_.rebase(odometry);
  if (!odometry.health.has_pose()) return;
  newest_ = odometry;
  place_in_local();
}

void Autopilot::add(const MapUpdate& update) {
  if (!update.localised || update.reset_counter != reset_counter_) return;
  T_MW_ = update.T_MW_smooth;
  place_in_local();
}

void Autopilot::place_in_local() {
  if (T_LM_) T_LW_ = *T_LM_ * T_MW_;
}

VehicleEstimate Autopilot::in_local(const LivePose& pose) const {
  const Pose<Local, W> T_LW = T_LW_.value_or(Pose<Local, W>{});
  VehicleEstimate e;
  e.T_LV = T_LW * pose.T_WB * mounting_.inverse();
  e.w_LV_V = mounting_.q * pose.w_WB_B;
  e.v_LV = T_LW.q * pose.v_WB - e.T_LV.q * e.w_LV_V.cross(mounting_.p);
  return e;
}

/// Places L at the standing vehicle, or, after a restart of the odometry, such that the vehicle keeps its last known position
/// and heading. Position and heading only: W is gravity-aligned.
void Autopilot::place_local_frame(const LivePose& pose) {
  const Pose<M, BodyFlu> T_MV = T_MW_ * pose.T_WB * mounting_.inverse();
  const bool in_flight = T_LW_.has_value();
  const double yaw_L = in_flight ? heading(reference_.estimate().T_LV.q) : 0;
  const Vec3 p_L = in_flight ? reference_.estimate().T_LV.p : Vec3(Vec3::Zero());
  const Quat q_LM = so3_exp(Vec3(0, 0, yaw_L - heading(T_MV.q)));
  T_LM_ = Pose<Local, M>(q_LM, Vec3(p_L - q_LM * T_MV.p));
  place_in_local();
}

PerRotor Autopilot::update(const ImuSample& reading) {
  const std::optional<LivePose> at_reading = propagator_.add(reading);
  if (!at_reading) return out_.control.commands;
  const LivePose& pose = *at_reading;
  const double dt_s = last_t_ ? (reading.t - *last_t_).seconds() : 1 / rate_hz_;
  last_t_ = reading.t;
  reference_.predict(reading, dt_s);
  const bool has_pose = pose.health.has_pose();
  bool restarted = false;
  if (has_pose && pose.reset_counter != reset_counter_) {
    restarted = T_LW_.has_value();
    reset_counter_ = pose.reset_counter;
    T_MW_ = {};
    if (restarted) place_local_frame(pose);
  }
  out_.t = reading.t;
  out_.health = pose.health;
  out_.estimate_age_s = pose.estimate_t.ns > 0 ? (reading.t - pose.estimate_t).seconds() : 0;
  if (has_pose) {
    out_.estimate = in_local(pose);
    reference_.follow(out_.estimate, newest_.bias);
  } else {
    out_.estimate = reference_.estimate();
  }

  FlightCondition seen{.health = pose.health, .estimate_age_s = out_.estimate_age_s, .restarted = restarted};
  seen.landing = guide_.landing();
  seen.on_ground = on_ground_;
  if (T_LW_ && spooling_s_ >= kSpool_s) {
    seen.off_path_m = (out_.estimate.T_LV.p - out_.setpoint.p).norm();
    seen.outside_fence = !fence_.contains(out_.estimate.T_LV.p) && !guide_.landing() && guide_.step() > 0;
  }
  const FlightMode before = out_.mode;
  out_.mode = failsafe_.update(seen, dt_s);
  out_.reason = failsafe_.reason();
  if (before == FlightMode::waiting && out_.mode == FlightMode::mission) {
    place_local_frame(pose);
    out_.estimate = in_local(pose);
    reference_.follow(out_.estimate, newest_.bias);
    guide_.begin(out_.estimate.T_LV);
    out_.setpoint.p = out_.estimate.T_LV.p;
  } else if (before == FlightMode::descending && out_.mode == FlightMode::landing) {
    guide_.land_from(out_.estimate.T_LV.p);
  }
  return act(dt_s);
}

PerRotor Autopilot::act(double dt_s) {
  const FlightMode mode = out_.mode;
  PerRotor commands{};
  if (mode == FlightMode::waiting || mode == FlightMode::landed) {
    commands = controller_.rest();
  } else if (spooling_s_ < kSpool_s) {
    spooling_s_ += dt_s;
    (void)controller_.rest();
    commands.fill(kIdle);
  } else if (mode == FlightMode::descending) {
    commands = controller_.level(out_.estimate, -kDescent_mps, heading(out_.estimate.T_LV.q));
    out_.setpoint.v = Vec3(0, 0, -kDescent_mps);
    watch_ground(dt_s);
  } else {
    if (mode == FlightMode::landing) guide_.land_here();
    out_.setpoint = guide_.next(mode == FlightMode::holding ? 0 : 1, out_.estimate.T_LV.p);
    commands = controller_.fly(out_.estimate, out_.setpoint);
    if (mode == FlightMode::landing) watch_ground(dt_s);
  }
  out_.control = controller_.trace();
  out_.control.commands = commands;
  out_.step = guide_.step();
  return commands;
}

void Autopilot::watch_ground(double dt_s) {
  const bool still =
      std::abs(out_.estimate.v_LV.z()) < kStill_mps && controller_.trace().thrust < kCarried * options_.position.MPC_THR_HOVER;
  still_s_ = still ? still_s_ + dt_s : 0;
  on_ground_ = still_s_ > kStill_s;
}

}  // namespace fbvins
