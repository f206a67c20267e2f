// SPDX-License-Identifier: Apache-2.0
// Private: readings of aiding sensors as ROS's messages, sensor_msgs/Range, geometry_msgs/TwistWithCovarianceStamped and
// sensor_msgs/FluidPressure, in both encodings, and back. Where the sensor sits is no part of them, but the pose of the frame
// that they name. Pure functions, any thread.
//
//   std::optional<AidingMessage> message = aiding_of(bytes, Encoding::cdr, "sensor_msgs/Range");
//   AidingSample reading = mounted(message->reading, T_BS);
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/geometry/pose.hpp"
#include "fbvins/io/message_fields.hpp"
#include "fbvins/types/aiding.hpp"

namespace fbvins {

/// Whether it is one of the three, without "msg/".
bool is_aiding_type(std::string_view type);

struct AidingMessage {
  AidingSample reading;  ///< as if the sensor's axes were the body's
  std::string frame;
};
/// None for bytes that are no such message, or a reading that cannot be (impossible()).
std::optional<AidingMessage> aiding_of(std::string_view bytes, Encoding encoding, std::string_view type);

/// Its bytes, with the head of CDR where that is the encoding.
std::string aiding_message(const AidingSample& reading, std::string_view frame, Encoding encoding);

/// The pose of the sensor's axes, the beam along x; nothing for one whose place does not matter.
std::optional<Pose<B, B>> mounting_of(const AidingSample& reading);
/// The reading of a sensor that sits there.
AidingSample mounted(AidingSample reading, const Pose<B, B>& T_BS);

/// How our own files call a kind of sensor, its topic without a number: "range", "velocity", "baro"; and its type.
std::string_view aiding_name(const AidingSample& reading);
std::string_view aiding_type(const AidingSample& reading);
/// Whether a topic is one of ours: "/range0".
bool is_own_aiding_topic(std::string_view topic);

/// Which sensor a reading is of, of those that come: the same pose, the same name.
class AidingSensors {
 public:
  struct Sensor {
    std::string name;  ///< "range0": its frame, and with a slash before its topic
    std::optional<Pose<B, B>> T_BS;
    std::string_view type;
    std::size_t topic = 0;  ///< its owner's
  };
  /// Null where it is a new one.
  Sensor* find(const AidingSample& reading);
  Sensor& add(const AidingSample& reading, std::size_t topic);
  const std::vector<Sensor>& all() const { return all_; }

 private:
  std::vector<Sensor> all_;
};

}  // namespace fbvins
