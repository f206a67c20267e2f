// SPDX-License-Identifier: Apache-2.0
// A process in ROS 2's graph, by DDS alone: topics are named and typed as ROS 2's middleware does (rt/<name>,
// <package>::msg::dds_::<Message>_), messages are the bytes of ros_messages.hpp.
//
//   auto node = Ros2Node::join({.domain = 0}, *parse_ros2_node("fbvins"));
//   auto odometry = Ros2Publisher::create(*node, (*node)->own_topic("odometry"), "nav_msgs/msg/Odometry");
//   odometry->publish(bytes);
//
// Threads: a node from any, a publisher from one at a time; a subscriber's function is called on a thread of DDS.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "fbvins/core/result.hpp"
#include "fbvins/io/ros_messages.hpp"
#include "fbvins/ros2/ros2_quality.hpp"

struct ddsi_sertype;

namespace fbvins {

/// Domain and network interface.
struct Ros2Address {
  std::uint32_t domain = 0;    ///< ROS_DOMAIN_ID
  std::string interface = {};  ///< of the network; empty: this machine alone
};
/// DOMAIN[:INTERFACE], as in "0" or "42:eth0".
Result<Ros2Address> parse_ros2_address(const std::string& text);

/// Owns a handle of CycloneDDS, and deletes it with its children.
class DdsEntity {
 public:
  DdsEntity() = default;
  explicit DdsEntity(std::int32_t handle) : handle_(handle) {}
  DdsEntity(DdsEntity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  DdsEntity& operator=(DdsEntity&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~DdsEntity();
  std::int32_t handle() const { return handle_; }

 private:
  std::int32_t handle_ = 0;
};

struct Ros2Name {
  std::string name_space = "/", name = "fbvins";
};
/// NAME or /NAMESPACE/NAME; letters, digits and underscores, not beginning with a digit.
Result<Ros2Name> parse_ros2_node(const std::string& text);

/// Tools such as `ros2 node list` see it by the topic ros_discovery_info, on which it says what it publishes and subscribes.
class Ros2Node {
 public:
  /// `humble`: for the tools of ROS 2 Humble, instead of those since Iron.
  static Result<std::shared_ptr<Ros2Node>> join(const Ros2Address& address, const Ros2Name& name = {}, bool humble = false,
                                                const Ros2QualityWishes& wishes = {});
  std::int32_t participant() const { return participant_.handle(); }
  /// "odometry" -> "/fbvins/odometry"
  std::string own_topic(const std::string& name) const;

  /// As the user wants it for this topic, else `usual`.
  Ros2Quality quality(const std::string& topic, Ros2Quality usual);
  /// A topic with a wish for which nobody has asked, when all topics are there; empty: none.
  std::string unused_wish() const;

  // Of the entities of this node, by their handles.
  Result<void> tell_of_writer(std::int32_t writer);
  Result<void> tell_of_reader(std::int32_t reader);
  void forget_reader(std::int32_t reader);

 private:
  Result<void> tell();

  DdsEntity domain_, participant_, graph_topic_, graph_;
  const ddsi_sertype* graph_type_ = nullptr;
  mutable std::mutex mutex_;
  RosNode self_;  ///< guarded by mutex_
  Ros2QualityWishes wishes_;
  std::set<std::string> topics_;  ///< that have a quality; guarded by mutex_
  bool humble_ = false;
};

class Ros2Publisher {
 public:
  /// `topic` as ROS names it ("/tf"), `type` as ROS names it ("tf2_msgs/msg/TFMessage").
  static Result<Ros2Publisher> create(std::shared_ptr<Ros2Node> node, const std::string& topic, const std::string& type,
                                      const Ros2Quality& quality = {});
  /// `message` with its CDR header. A slow reliable reader blocks it for a tenth of a second at most.
  Result<void> publish(std::string message) const;
  /// Matched now. From any thread.
  int subscribers() const;

 private:
  std::shared_ptr<Ros2Node> node_;
  DdsEntity topic_, writer_;
  const ddsi_sertype* type_ = nullptr;  // the topic's
  std::string name_;
};

class Ros2Subscriber {
 public:
  /// The bytes stay valid as long as `keeper` lives.
  using OnMessage = std::function<void(std::string_view message, const std::shared_ptr<const void>& keeper)>;

  /// With the reliability that all publishers of the topic offer, best effort until there is one, unless the user wants one.
  static Result<std::unique_ptr<Ros2Subscriber>> create(std::shared_ptr<Ros2Node> node, const std::string& topic,
                                                        const std::string& type, int depth, OnMessage on_message);
  ~Ros2Subscriber();
  Ros2Subscriber(const Ros2Subscriber&) = delete;
  Ros2Subscriber& operator=(const Ros2Subscriber&) = delete;

  /// Number of matched publishers.
  int publishers() const;
  /// Adapts to a publisher with another reliability; to be called periodically. An error where a publisher has another type.
  Result<void> look_around();

 private:
  Ros2Subscriber() = default;
  Result<void> listen(bool reliable);

  std::shared_ptr<Ros2Node> node_;
  std::string name_, type_;
  int depth_ = 0;
  bool reliable_ = false;
  OnMessage on_message_;
  std::map<std::uint64_t, bool> offered_reliable_;  ///< by publisher, as DDS numbers them
  DdsEntity topic_, offers_, reader_;
};

}  // namespace fbvins
