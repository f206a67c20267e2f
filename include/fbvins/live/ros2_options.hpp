// SPDX-License-Identifier: Apache-2.0
// Options of the ROS 2 topics: `live.ros2` in a configuration (docs/ros2.md).
#pragma once

#include <string>

namespace fbvins {

/// On which clock stamps are: the sensors' own, or ROS time, which is this machine's CLOCK_REALTIME.
enum class Ros2Clock { sensors, ros };

/// Whose nodes are to see this one. Since Iron the message that tells of nodes (rmw_dds_common) is another one.
enum class Ros2Distribution {
  environment,  ///< that of ROS_DISTRO, as ROS's setup.bash sets it; without it iron
  iron,
  humble
};

struct Ros2Options {
  std::string node = "fbvins";
  std::string map_frame = "map";
  std::string odometry_frame = "odom";
  std::string base_frame = "base_link";
  std::string imu_frame = "imu_link";
  Ros2Clock clock = Ros2Clock::sensors;
  Ros2Distribution distribution = Ros2Distribution::environment;
  bool publish_tf = true;
  std::string qos = {};

  template <class V>
  void visit(V&& v) {
    v("node", node, "", "name of the node, and of its topics' first part; with a namespace as in /drone1/fbvins");
    v("map_frame", map_frame, "", "frame M, above the odometry's");
    v("odometry_frame", odometry_frame, "", "frame W");
    v("base_frame", base_frame, "",
      "the vehicle: x forward, y left, z up, placed by live.mavlink.mounting; empty: none, the IMU itself");
    v("imu_frame", imu_frame, "", "the IMU's frame B; those of the cameras are named camera0_optical and so on");
    v("clock", clock, "sensors|ros", "whose clock stamps are on; ros: CLOCK_REALTIME of this machine");
    v("distribution", distribution, "environment|iron|humble",
      "ROS's distribution whose tools show the node; iron: that and all later ones; environment: as ROS_DISTRO says");
    v("publish_tf", publish_tf, "",
      "false where another node, such as a filter, publishes the transform from the odometry's frame to the vehicle's");
    v("qos", qos, "",
      "other qualities of service: TOPIC=SETTING/SETTING..., separated by commas; settings are reliable, best_effort, transient_local, "
      "volatile and the length of the queue");
  }
};

}  // namespace fbvins
