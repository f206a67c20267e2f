// SPDX-License-Identifier: Apache-2.0
// Private to bags: a file of messages on topics, whichever its format. All messages in the file's order without need of an index,
// and each of them again by its place. One thread at a time.
//
//   Result<std::unique_ptr<BagReader>> bag = open_bag("flight.bag");
//   while (auto message = (*bag)->next()) use((*bag)->topics()[message->topic].name, message->data);
//   std::string again = (*bag)->read(place);
//
// A truncated file is read up to its last complete record; what cannot be read is skipped and counted.
#pragma once

#include <compare>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/bags/message_fields.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/io/byte_source.hpp"

namespace fbvins {

struct BagTopic {
  std::string name;
  std::string type;  ///< "sensor_msgs/Imu": without the "/msg" of ROS 2
  Encoding encoding = Encoding::ros1;
};

/// Where a message lies: in which chunk (a place in the file, or a row of a table), and in it.
struct MessagePlace {
  std::uint64_t chunk = 0, offset = 0, length = 0;
  auto operator<=>(const MessagePlace&) const = default;
};

struct BagMessage {
  std::size_t topic = 0;  ///< of topics()
  Time log_time;
  std::string_view data;  ///< until next()
  MessagePlace place;
};

struct BagDamage {
  int parts = 0;            ///< left out
  std::string first;        ///< "file: sentence" about the first of them
  bool ends_early = false;  ///< the writer, or a copy, was cut off
};

class BagReader {
 public:
  virtual ~BagReader() = default;

  virtual std::string format() const = 0;
  /// Those met so far.
  const std::vector<BagTopic>& topics() const { return topics_; }
  const BagDamage& damage() const { return damage_; }

  virtual std::optional<BagMessage> next() = 0;
  /// The bytes of a message that next() has shown; empty where they cannot be read any more.
  virtual std::string read(const MessagePlace& place) = 0;

 protected:
  void complain(std::string sentence) {
    if (damage_.parts++ == 0) damage_.first = std::move(sentence);
  }

  std::vector<BagTopic> topics_;
  BagDamage damage_;
};

/// "sensor_msgs/msg/Imu" and "sensor_msgs/Imu" are one.
std::string plain_type(std::string type);

/// A ROS 1 bag, a ROS 2 bag (folder, .db3 or .mcap), or an MCAP file of ROS messages, by content.
Result<std::unique_ptr<BagReader>> open_bag(const std::string& path);

// `name` is only for messages.
Result<std::unique_ptr<BagReader>> read_ros1_bag(std::shared_ptr<const ByteSource> bytes, const std::string& name);
Result<std::unique_ptr<BagReader>> read_mcap_bag(std::shared_ptr<const ByteSource> bytes, const std::string& name);
Result<std::unique_ptr<BagReader>> open_sqlite_bag(const std::vector<std::string>& files, bool zstd_messages);

}  // namespace fbvins
