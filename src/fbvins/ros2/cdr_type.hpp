// SPDX-License-Identifier: Apache-2.0
// A CycloneDDS type whose messages are serialised bytes: the CDR that ros_messages.hpp writes and reads, so that nothing is
// generated from an IDL and an image is copied once. Types have no key, as all of ROS 2's.
#pragma once

#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>

#include <string>
#include <string_view>

namespace fbvins {

/// A type with the name that ROS 2's middleware gives it on the wire: "sensor_msgs::msg::dds_::Imu_". For
/// dds_create_topic_sertype(), which takes over the reference.
ddsi_sertype* make_cdr_type(const std::string& type_name);
/// A message with one reference; `bytes` include the encapsulation header of four bytes.
ddsi_serdata* make_cdr_message(const ddsi_sertype& type, std::string bytes);
/// Of a message that was made or received with a type of make_cdr_type(); with the header.
std::string_view bytes_of(const ddsi_serdata& message);

}  // namespace fbvins
