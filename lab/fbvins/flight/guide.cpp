// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/guide.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fbvins/flight/excitation.hpp"
#include "fbvins/sim/flight_path.hpp"

namespace fbvins {
namespace {

constexpr double kCornerRadius_m = 0.3;
constexpr std::size_t kHeldEnds = 24;
constexpr double kArrived_m = 0.2, kLongestWait_s = 8;
/// Below this speed `nose_first` keeps the heading.
constexpr double kNoseSpeed_mps = 0.15;
constexpr double kYawAccel_radps2 = 2.0, kYawGain_per_s = 2.0;
constexpr double kDescentAccel_mps2 = 0.5;

double wrapped(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

SplineTrajectory spline_along(std::vector<Vec3> corners, const MotionLimits& limits) {
  // Corner smoothing would move the ends, too: repeat them over its reach.
  corners.insert(corners.begin(), kHeldEnds, Vec3(corners.front()));
  corners.insert(corners.end(), kHeldEnds, Vec3(corners.back()));
  TimedPath path = fly_along(corners, limits, kCornerRadius_m);
  // A spline of degree five begins after two control points and ends before the last three.
  path.positions.insert(path.positions.begin(), 3, Vec3(path.positions.front()));
  path.positions.insert(path.positions.end(), 3, Vec3(path.positions.back()));
  const std::vector<Quat> level(path.positions.size(), Quat::Identity());
  return {path.knot_spacing_s, path.positions, level};
}

}  // namespace

void YawGuide::turn(double wanted_rad, double rate_max_radps, double dt_s) {
  const double error = wrapped(wanted_rad - yaw_);
  // Braking at half the largest acceleration must suffice.
  const double stoppable = std::sqrt(2 * 0.5 * kYawAccel_radps2 * std::abs(error));
  const double rate = std::copysign(std::min({rate_max_radps, stoppable, kYawGain_per_s * std::abs(error)}), error);
  rate_ += std::clamp(rate - rate_, -kYawAccel_radps2 * dt_s, kYawAccel_radps2 * dt_s);
  yaw_ = wrapped(yaw_ + rate_ * dt_s);
}

Guide::Guide(const Mission& mission, double rate_hz) : steps_(mission.steps), limits_(mission.limits), dt_s_(1 / rate_hz) {}

void Guide::begin(const Pose<Local, BodyFlu>& standing) {
  now_ = {};
  now_.p = standing.p;
  const Vec3 nose = standing.q * Vec3::UnitX();
  now_.yaw_rad = wanted_yaw_rad_ = std::atan2(nose.y(), nose.x());
  yaw_.set(now_.yaw_rad);
  step_ = 0;
  begin_step();
}

void Guide::begin_step() {
  at_s_ = waited_s_ = length_s_ = 0;
  path_ = {};
  if (done()) return;
  const MissionStep& step = steps_[step_];
  MotionLimits limits{limits_.speed_mps, limits_.accel_mps2, limits_.jerk_mps3};
  std::vector<Vec3> corners{now_.p};
  switch (step.kind) {
    case MissionStep::Kind::takeoff:
      corners.emplace_back(now_.p.x(), now_.p.y(), step.height_m);
      limits.speed_mps = limits_.climb_mps;
      break;
    case MissionStep::Kind::go:
      corners.insert(corners.end(), step.points.begin(), step.points.end());
      if (step.speed_mps > 0) limits.speed_mps = step.speed_mps;
      break;
    case MissionStep::Kind::hold: length_s_ = step.seconds; break;
    case MissionStep::Kind::yaw: wanted_yaw_rad_ = step.yaw_rad; break;
    case MissionStep::Kind::identify:
      length_s_ = excitation_length_s();
      hover_ = now_;
      break;
    case MissionStep::Kind::land: landing_ = true; break;
  }
  if (corners.size() < 2) return;
  path_ = spline_along(corners, limits);
  length_s_ = path_.duration_s();
}

void Guide::land_here() {
  if (landing_) return;
  steps_.resize(std::min(steps_.size(), step_ + 1));
  MissionStep down;
  down.kind = MissionStep::Kind::land;
  steps_.push_back(down);
  step_ = steps_.size() - 1;
  path_ = {};
  wanted_yaw_rad_ = yaw_.yaw_rad();
  landing_ = true;
}

void Guide::land_from(const Vec3& p_L) {
  land_here();
  now_.p = p_L;
  now_.v.setZero();
  now_.a.setZero();
  descent_mps_ = 0;
  yaw_.set(yaw_.yaw_rad());
}

bool Guide::step_over(const Vec3& p_L) const {
  if (done() || landing_) return false;
  const MissionStep& step = steps_[step_];
  if (step.kind == MissionStep::Kind::yaw) return std::abs(wrapped(wanted_yaw_rad_ - yaw_.yaw_rad())) < 0.01;
  return at_s_ >= length_s_ && ((p_L - now_.p).norm() < kArrived_m || waited_s_ > kLongestWait_s);
}

/// The pace follows as a critically damped second-order system, slower at higher speed, so that braking keeps the limits.
void Guide::change_pace(double wanted) {
  const double speed = std::max(0.1, now_.v.norm());
  const double w = std::clamp(std::min(0.7 * limits_.accel_mps2 / speed, std::sqrt(limits_.jerk_mps3 / speed)), 0.5, 4.0);
  pace_rate_ += dt_s_ * (w * w * (wanted - pace_) - 2 * w * pace_rate_);
  pace_ = std::clamp(pace_ + dt_s_ * pace_rate_, 0.0, 1.0);
}

PathSetpoint Guide::along_path() {
  at_s_ = std::min(at_s_ + pace_ * dt_s_, length_s_);
  const MotionState m = path_.at(at_s_);
  const bool moving = at_s_ < length_s_;
  PathSetpoint next = now_;
  next.p = m.T_WB.p;
  next.v = moving ? Vec3(pace_ * m.v_WB) : Vec3(Vec3::Zero());
  next.a = moving ? Vec3(pace_ * pace_ * m.a_WB + pace_rate_ * m.v_WB) : Vec3(Vec3::Zero());
  if (steps_[step_].nose_first && next.v.head<2>().norm() > kNoseSpeed_mps) wanted_yaw_rad_ = std::atan2(next.v.y(), next.v.x());
  return next;
}

/// Brakes horizontally, then descends.
PathSetpoint Guide::down() {
  PathSetpoint next = now_;
  const double braking = std::max(0.0, 1 - limits_.accel_mps2 * dt_s_ / std::max(1e-6, now_.v.head<2>().norm()));
  next.v.head<2>() = braking * now_.v.head<2>();
  const double wanted = next.v.head<2>().norm() < 0.1 ? limits_.land_mps * pace_ : 0;
  descent_mps_ += std::clamp(wanted - descent_mps_, -kDescentAccel_mps2 * dt_s_, kDescentAccel_mps2 * dt_s_);
  next.v.z() = -descent_mps_;
  next.p += dt_s_ * next.v;
  next.a.setZero();
  return next;
}

PathSetpoint Guide::next(double pace, const Vec3& p_L) {
  if (step_over(p_L)) {
    ++step_;
    begin_step();
  }
  change_pace(pace);
  if (landing_) {
    now_ = down();
  } else if (path_.duration_s() > 0 && !done()) {
    now_ = along_path();
  } else if (!done() && steps_[step_].kind == MissionStep::Kind::identify) {
    at_s_ = std::min(at_s_ + pace_ * dt_s_, length_s_);
    now_ = excitation_setpoint(hover_, at_s_);
  } else {
    at_s_ += pace_ * dt_s_;
    now_.v.setZero();
    now_.a.setZero();
  }
  if (at_s_ >= length_s_) waited_s_ += dt_s_;
  if (!done() && steps_[step_].kind == MissionStep::Kind::identify) return now_;
  yaw_.turn(wanted_yaw_rad_, limits_.yaw_rate_radps * pace_, dt_s_);
  now_.yaw_rad = yaw_.yaw_rad();
  now_.yaw_rate_radps = yaw_.rate_radps();
  return now_;
}

}  // namespace fbvins
