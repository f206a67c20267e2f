// SPDX-License-Identifier: Apache-2.0
// What to do when the odometry is not what it should be. Two questions are kept apart: may it go on, and is there anything to fly
// by at all. One owner.
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
  mission,     ///< along the mission
  holding,     ///< slowed down to a stop, by a pose that is good enough for that
  landing,     ///< straight down, by poses
  descending,  ///< level and down, by IMU and barometer: nothing is known of where it is
  landed,      ///< rotors off
};

enum class FlightReason {
  none,
  no_pose,    ///< before take-off: the odometry has not become good in time
  degraded,   ///< the odometry says so
  late,       ///< the newest estimate is old
  restarted,  ///< the odometry began anew
  lost,       ///< the odometry has no pose, or has been silent for too long
  off_path,   ///< the vehicle does not follow
  outside_fence,
  flight_controller,  ///< it did so by itself, or would not begin
};

std::string_view to_string(FlightMode mode);
std::string_view to_string(FlightReason reason);

/// What the failsafe looks at, at one reading.
struct FlightCondition {
  Health health;
  double estimate_age_s = 0;
  bool restarted = false;  ///< with this reading
  double off_path_m = 0;   ///< from the setpoint to the estimate
  bool outside_fence = false;
  bool landing = false;    ///< the mission itself comes down
  bool on_ground = false;  ///< as far as the controller can tell
};

class Failsafe {
 public:
  FlightMode update(const FlightCondition& seen, double dt_s);

  FlightMode mode() const { return mode_; }
  /// Why it is not `mission`; of `landed`, why it came down, if not by plan.
  FlightReason reason() const { return reason_; }

 private:
  void enter(FlightMode mode, FlightReason reason);
  FlightReason trouble(const FlightCondition& seen, double dt_s);

  FlightMode mode_ = FlightMode::waiting;
  FlightReason reason_ = FlightReason::none;
  double good_s_ = 0, degraded_s_ = 0, off_path_s_ = 0, in_mode_s_ = 0;
};

}  // namespace fbvins
