// SPDX-License-Identifier: Apache-2.0
// The flight mode as a function of the odometry's health. Two questions are kept apart: may the mission continue, and is there
// a pose to fly by at all. One owner.
//
//   FlightMode mode = failsafe.update(seen, dt_s);
//
//   waiting -> mission <-> holding -> landing -> landed
//                 '-----------'-----> descending -> landed
#pragma once

#include <string_view>

#include "fbvins/types/odometry.hpp"

namespace fbvins {

enum class FlightMode {
  waiting,     ///< on the ground, until the odometry is good
  mission,     ///< flies the mission
  holding,     ///< slows down to a stop, by poses
  landing,     ///< straight down, by poses
  descending,  ///< level descent by IMU and barometer: there is no pose
  landed,      ///< rotors off
};

enum class FlightReason {
  none,
  no_pose,    ///< before take-off: the odometry did not become good in time
  degraded,   ///< the odometry's health is not good
  late,       ///< the newest estimate is old
  restarted,  ///< the odometry started again with a new W
  lost,       ///< the odometry has no pose, or has been silent for too long
  off_path,   ///< the vehicle does not follow the setpoint
  outside_fence,
  flight_controller,  ///< PX4 or ArduPilot left the mission by itself, or did not start it
};

std::string_view to_string(FlightMode mode);
std::string_view to_string(FlightReason reason);

/// Input of the failsafe at one IMU reading.
struct FlightCondition {
  Health health;
  double estimate_age_s = 0;
  bool restarted = false;  ///< at this reading
  double off_path_m = 0;   ///< from the setpoint to the estimate
  bool outside_fence = false;
  bool landing = false;    ///< the mission is at its landing step
  bool on_ground = false;  ///< as detected by the controller
};

class Failsafe {
 public:
  FlightMode update(const FlightCondition& seen, double dt_s);

  FlightMode mode() const { return mode_; }
  /// Why the mode is not `mission`; in `landed`, why the vehicle came down, none if by plan.
  FlightReason reason() const { return reason_; }

 private:
  void enter(FlightMode mode, FlightReason reason);
  FlightReason trouble(const FlightCondition& seen, double dt_s);

  FlightMode mode_ = FlightMode::waiting;
  FlightReason reason_ = FlightReason::none;
  double good_s_ = 0, degraded_s_ = 0, off_path_s_ = 0, in_mode_s_ = 0;
};

}  // namespace fbvins
