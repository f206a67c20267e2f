// SPDX-License-Identifier: Apache-2.0
// Private to ros2: names, types and qualities of service as ROS 2's middleware has them in DDS. Pure functions, any thread.
#pragma once

#include <dds/dds.h>

#include <memory>
#include <string>
#include <string_view>

#include "fbvins/core/result.hpp"
#include "fbvins/ros2/ros2_node.hpp"

namespace fbvins {

Error dds_failure(std::string_view what, dds_return_t code);

/// "nav_msgs/msg/Odometry" -> "nav_msgs::msg::dds_::Odometry_"
std::string wire_type(const std::string& type);
/// "/tf" -> "rt/tf"
std::string wire_topic(const std::string& topic);

struct DeleteQos {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using Qos = std::unique_ptr<dds_qos_t, DeleteQos>;

/// With the hash of the type, where it is one that we publish.
Qos make_qos(const Ros2Quality& quality, const std::string& type);

struct TopicOfBytes {
  DdsEntity entity;
  const ddsi_sertype* type;
};
/// `topic` as DDS has it, `type` as ROS has it.
Result<TopicOfBytes> make_wire_topic(dds_entity_t participant, const std::string& topic, const std::string& type);

/// `message` with its CDR header.
Result<void> write_bytes(dds_entity_t writer, const ddsi_sertype& type, std::string message, std::string_view name);

}  // namespace fbvins
