// SPDX-License-Identifier: Apache-2.0
// Turns the steps of a mission into a setpoint that moves within limits of speed, acceleration and jerk, and can be slowed down
// to a stop anywhere on its way and go on from there. One owner.
//
//   Guide guide(mission, 200);
//   guide.begin(state.T_LV);
//   PathSetpoint wanted = guide.next(1.0, state.T_LV.p);   // 1: at full pace, 0: stopped
#pragma once

#include <vector>

#include "fbvins/flight/mission.hpp"
#include "fbvins/flight/position_controller.hpp"
#include "fbvins/sim/spline.hpp"

namespace fbvins {

/// A yaw that moves within limits of rate and acceleration.
class YawGuide {
 public:
  void set(double yaw_rad) { yaw_ = yaw_rad, rate_ = 0; }
  void turn(double wanted_rad, double rate_max_radps, double dt_s);
  double yaw_rad() const { return yaw_; }
  double rate_radps() const { return rate_; }

 private:
  double yaw_ = 0, rate_ = 0;
};

class Guide {
 public:
  Guide(const Mission& mission, double rate_hz);

  /// Where the vehicle stands; the first step begins.
  void begin(const Pose<Local, BodyFlu>& standing);
  /// The setpoint one update later. `pace`: 1 to go on, 0 to stop; what lies between is reached smoothly. `p_L`: where the
  /// vehicle is, as a step ends only where it has arrived.
  PathSetpoint next(double pace, const Vec3& p_L);
  /// Leaves the mission: brakes and comes down.
  void land_here();
  /// The same from where the vehicle is, wherever the setpoint was.
  void land_from(const Vec3& p_L);

  /// Index of the step; their number when all are done.
  std::size_t step() const { return step_; }
  bool landing() const { return landing_; }
  bool done() const { return step_ >= steps_.size(); }
  double pace() const { return pace_; }

 private:
  void begin_step();
  bool step_over(const Vec3& p_L) const;
  PathSetpoint along_path();
  PathSetpoint down();
  void change_pace(double wanted);

  std::vector<MissionStep> steps_;
  MissionLimits limits_;
  double dt_s_;
  std::size_t step_ = 0;
  bool landing_ = false;
  PathSetpoint now_, hover_;
  SplineTrajectory path_;  ///< of the step, in L; empty where it stays
  double length_s_ = 0;    ///< of the step at full pace
  double at_s_ = 0;        ///< how far it has come
  double waited_s_ = 0;    ///< at its end
  double pace_ = 1, pace_rate_ = 0;
  double wanted_yaw_rad_ = 0;
  double descent_mps_ = 0;
  YawGuide yaw_;
};

}  // namespace fbvins
