// SPDX-License-Identifier: Apache-2.0
// Generates setpoints from the steps of a mission within limits of speed, acceleration and jerk. It can slow down to a stop
// anywhere and continue from there. One owner.
//
//   Guide guide(mission, 200);
//   guide.begin(state.T_LV);
//   PathSetpoint wanted = guide.next(1.0, state.T_LV.p);   // 1: full pace, 0: stop
#pragma once

#include <vector>

#include "fbvins/flight/mission.hpp"
#include "fbvins/flight/position_controller.hpp"
#include "fbvins/sim/spline.hpp"

namespace fbvins {

/// A yaw setpoint with limited rate and acceleration.
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

  /// Begins the first step at the vehicle's pose.
  void begin(const Pose<Local, BodyFlu>& standing);
  /// The next setpoint. `pace`: wanted speed along the path as a share, 1 to go on, 0 to stop; it is approached smoothly. `p_L`:
  /// the estimated position; a step ends once it is near the setpoint, or after a timeout.
  PathSetpoint next(double pace, const Vec3& p_L);
  /// Aborts the mission: brakes and lands.
  void land_here();
  /// As land_here(), with the setpoint moved to p_L.
  void land_from(const Vec3& p_L);

  /// Index of the current step; the number of steps when all are done.
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
  SplineTrajectory path_;  ///< of the step, in L; empty if the step has none
  double length_s_ = 0;    ///< of the step at full pace
  double at_s_ = 0;        ///< time along the step at full pace
  double waited_s_ = 0;    ///< at the end of the step
  double pace_ = 1, pace_rate_ = 0;
  double wanted_yaw_rad_ = 0;
  double descent_mps_ = 0;
  YawGuide yaw_;
};

}  // namespace fbvins
