// SPDX-License-Identifier: Apache-2.0
// Options of `fbvins live` and LiveSystem: `live` in a configuration. SI units.
#pragma once

#include "fbvins/live/mavlink_options.hpp"
#include "fbvins/live/ros2_options.hpp"

namespace fbvins {

/// Monitoring of live sensors, and publishing of poses.
struct LiveOptions {
  double smoothing_s = 0.1;
  double camera_silence_s = 0.2;
  double imu_silence_s = 0.1;
  MavlinkOptions mavlink = {};
  Ros2Options ros2 = {};

  template <class V>
  void visit(V&& v) {
    v("smoothing_s", smoothing_s, "s", "time constant to take over a new estimate at IMU rate, 0: at once", 0.0, 2.0);
    v("camera_silence_s", camera_silence_s, "s", "without an image for this long health is degraded", 0.02, 10.0);
    v("imu_silence_s", imu_silence_s, "s", "without an IMU reading for this long health is degraded", 0.01, 10.0);
    v.group("mavlink", mavlink, "poses to a flight controller (--mavlink)");
    v.group("ros2", ros2, "topics of ROS 2 (--ros2)");
  }
};

}  // namespace fbvins
