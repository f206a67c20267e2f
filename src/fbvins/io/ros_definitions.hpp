// SPDX-License-Identifier: Apache-2.0
// Private: what the fields of ROS 2's messages are, as recordings carry it with them (encoding "ros2msg").
#pragma once

#include <string>
#include <string_view>

namespace fbvins {

/// The fields of `type`, for example "sensor_msgs/msg/Imu", and below them those of all types that it is made of. The type must
/// be one of those that flight records use.
std::string ros_definition(std::string_view type);

}  // namespace fbvins
