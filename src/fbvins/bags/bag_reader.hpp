// SPDX-License-Identifier: Apache-2.0
// Private to bags: a file of messages on topics, whichever its format. All messages in the file's order without need of an index,
// and each of them again by its place. One thread at a time.
//
//   Result<std::unique_ptr<BagReader>> bag = open_bag("flight.bag");
//   while (auto message = (*bag)->next()) use((*bag)->topics()[message->topic].name, message->data);
//   std::string_view again = (*bag)->read(place);
//
// A truncated file is read up to its last complete record; what cannot be read is skipped and counted. With only(), next() leaves
// out what was recorded outside of an interval, without reading it where an index tells: that of each chunk in ROS 1 bags and
// MCAP files (the one at the end of the file is not needed), or SQLite's own.
#pragma once

#include <compare>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/byte_source.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/io/message_fields.hpp"

namespace fbvins {

struct BagTopic {
  std::string name;
  std::string type;  ///< "sensor_msgs/Imu": without the "/msg" of ROS 2
  Encoding encoding = Encoding::ros1;
  bool operator==(const BagTopic&) const = default;
};

/// Where a message lies: its chunk (by its offset in the file) and offset there; in SQLite the number of the file, and the row.
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
  struct Window {
    Duration from, to;  ///< counted from the first message
  };

  virtual ~BagReader() = default;

  virtual std::string format() const = 0;
  /// Those read so far.
  const std::vector<BagTopic>& topics() const { return topics_; }
  const BagDamage& damage() const { return damage_; }
  /// Topics that are no messages of ROS, "TOPIC (TYPE, ENCODING)", of which nothing is read; of what was read so far.
  const std::set<std::string>& strangers() const { return strangers_; }

  /// Before the first next(): only what was recorded in [from, to), counted from the file's first message, but also the first
  /// message of each topic, and static transforms.
  void only(Duration from, Duration to) { window_ = {from, to}; }
  std::optional<BagMessage> next();
  /// The bytes of a message that next() has returned, until the next read(); empty where they cannot be read again.
  virtual std::string_view read(const MessagePlace& place) = 0;

 protected:
  /// The next message that is not skipped.
  virtual std::optional<BagMessage> advance() = 0;
  /// Whether a part of the file with messages of these topics from `first` to `last` can be skipped.
  bool can_leave_out(Time first, Time last, const std::vector<std::size_t>& topics);
  const std::optional<Window>& window() const { return window_; }
  static bool stays(const BagTopic& topic) { return topic.name.ends_with("tf_static"); }

  /// The topic's index in topics_, to which it is added if it is new: several publishers of a topic are one.
  std::size_t number_of(BagTopic topic);

  void complain(std::string sentence) {
    if (damage_.parts++ == 0) damage_.first = std::move(sentence);
  }

  std::vector<BagTopic> topics_;
  std::set<std::string> strangers_;
  BagDamage damage_;

 private:
  bool is_in_window(Time first, Time last);

  std::optional<Window> window_;
  std::optional<Time> origin_;  ///< of the first message
  std::vector<bool> begun_;     ///< topics whose first message has been returned
};

/// "sensor_msgs/msg/Imu" and "sensor_msgs/Imu" are one.
std::string plain_type(std::string type);

/// By its name (.bag; .bag.active while it is recorded, or after the recorder was killed) or content.
bool is_ros1_bag(const std::string& path);
/// A ROS 1 bag, a ROS 2 bag (folder, .db3 or .mcap), or an MCAP file of ROS messages, by content.
Result<std::unique_ptr<BagReader>> open_bag(const std::string& path);

// `name` is only for messages.
Result<std::unique_ptr<BagReader>> read_ros1_bag(std::shared_ptr<const ByteSource> bytes, const std::string& name);
Result<std::unique_ptr<BagReader>> read_mcap_bag(std::shared_ptr<const ByteSource> bytes, const std::string& name);
Result<std::unique_ptr<BagReader>> open_sqlite_bag(const std::vector<std::string>& files, bool zstd_messages);

}  // namespace fbvins
