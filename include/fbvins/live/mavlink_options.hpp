// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "fbvins/mavlink/mounting_options.hpp"

namespace fbvins {

/// px4: ODOMETRY; ardupilot: VISION_POSITION_ESTIMATE and VISION_SPEED_ESTIMATE.
enum class MavlinkDialect { px4, ardupilot };

struct MavlinkOptions {
  MavlinkDialect dialect = MavlinkDialect::px4;
  double rate_hz = 50;
  int system_id = 1;
  int component_id = 197;
  MountingOptions mounting = {};

  template <class V>
  void visit(V&& v) {
    v("dialect", dialect, "px4|ardupilot", "which messages carry the pose");
    v("rate_hz", rate_hz, "Hz", "poses sent per second, no more than the IMU's rate", 1.0, 1000.0);
    v("system_id", system_id, "", "the vehicle's number (PX4 MAV_SYS_ID, ArduPilot SYSID_THISMAV)", 1, 255);
    v("component_id", component_id, "", "component of this computer; 197: visual-inertial odometry", 1, 255);
    v.group("mounting", mounting, "the IMU on the vehicle, and the local frame");
  }
};

}  // namespace fbvins
