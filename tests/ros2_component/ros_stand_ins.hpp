// SPDX-License-Identifier: Apache-2.0
// What the component of ros2/ uses of ROS 2, for a test without it: messages with their fields, and a node whose topics lead to
// subscriptions of the same process at once. Names are ROS's.
#pragma once

#include <any>
#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace builtin_interfaces::msg {
struct Time {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
};
}  // namespace builtin_interfaces::msg

namespace std_msgs::msg {
struct Header {
  builtin_interfaces::msg::Time stamp;
  std::string frame_id;
};
}  // namespace std_msgs::msg

namespace geometry_msgs::msg {
struct Vector3 {
  double x = 0, y = 0, z = 0;
};
struct Point {
  double x = 0, y = 0, z = 0;
};
struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;
};
struct Pose {
  Point position;
  Quaternion orientation;
};
struct PoseWithCovariance {
  Pose pose;
  std::array<double, 36> covariance{};
};
struct Twist {
  Vector3 linear, angular;
};
struct TwistWithCovariance {
  Twist twist;
  std::array<double, 36> covariance{};
};
struct Transform {
  Vector3 translation;
  Quaternion rotation;
};
struct TransformStamped {
  std_msgs::msg::Header header;
  std::string child_frame_id;
  Transform transform;
};
}  // namespace geometry_msgs::msg

namespace nav_msgs::msg {
struct Odometry {
  std_msgs::msg::Header header;
  std::string child_frame_id;
  geometry_msgs::msg::PoseWithCovariance pose;
  geometry_msgs::msg::TwistWithCovariance twist;
};
}  // namespace nav_msgs::msg

namespace tf2_msgs::msg {
struct TFMessage {
  std::vector<geometry_msgs::msg::TransformStamped> transforms;
};
}  // namespace tf2_msgs::msg

namespace sensor_msgs {
namespace msg {
struct Image {
  using ConstSharedPtr = std::shared_ptr<const Image>;
  std_msgs::msg::Header header;
  std::uint32_t height = 0, width = 0;
  std::string encoding;
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;
  std::vector<std::uint8_t> data;
};
struct Imu {
  using ConstSharedPtr = std::shared_ptr<const Imu>;
  std_msgs::msg::Header header;
  geometry_msgs::msg::Vector3 angular_velocity, linear_acceleration;
};
}  // namespace msg
namespace image_encodings {
inline const std::string MONO8 = "mono8", TYPE_8UC1 = "8UC1";
}  // namespace image_encodings
}  // namespace sensor_msgs

namespace diagnostic_msgs::msg {
struct KeyValue {
  std::string key, value;
};
struct DiagnosticStatus {
  static constexpr std::uint8_t OK = 0, WARN = 1, ERROR = 2;
  std::uint8_t level = OK;
  std::string name, message, hardware_id;
  std::vector<KeyValue> values;
};
struct DiagnosticArray {
  std_msgs::msg::Header header;
  std::vector<DiagnosticStatus> status;
};
}  // namespace diagnostic_msgs::msg

namespace std_srvs::srv {
struct Trigger {
  struct Request {};
  struct Response {
    bool success = false;
    std::string message;
  };
};
}  // namespace std_srvs::srv

namespace rclcpp {

/// All topics and services of the process, and what the nodes have warned of; of one test.
struct StandInGraph {
  std::map<std::string, std::vector<std::function<void(const std::any&)>>> listeners;
  std::map<std::string, std::any> services;
  std::vector<std::string> warnings;
  static StandInGraph& instance() {
    static StandInGraph graph;
    return graph;
  }
};

struct QoS {
  explicit QoS(std::size_t depth) : depth_(depth) {}
  QoS& keep_last(std::size_t depth) { return depth_ = depth, *this; }
  QoS& transient_local() { return *this; }

 private:
  std::size_t depth_;
};
struct SensorDataQoS : QoS {
  SensorDataQoS() : QoS(5) {}
};

enum class IntraProcessSetting { Enable, Disable, NodeDefault };
struct PublisherOptions {
  IntraProcessSetting use_intra_process_comm = IntraProcessSetting::NodeDefault;
};

template <class M>
struct Publisher {
  using SharedPtr = std::shared_ptr<Publisher>;
  std::string topic;
  void publish(const M& message) {
    const auto kept = std::make_shared<const M>(message);
    for (const auto& listener : StandInGraph::instance().listeners[topic]) listener(std::any(kept));
  }
};
template <class M>
struct Subscription {
  using SharedPtr = std::shared_ptr<Subscription>;
};
template <class S>
struct Service {
  using SharedPtr = std::shared_ptr<Service>;
  using Call = std::function<void(const std::shared_ptr<typename S::Request>&, const std::shared_ptr<typename S::Response>&)>;
};

struct Clock {
  using SharedPtr = std::shared_ptr<Clock>;
  builtin_interfaces::msg::Time now() const {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const auto whole = std::chrono::duration_cast<std::chrono::seconds>(now);
    return {static_cast<std::int32_t>(whole.count()), static_cast<std::uint32_t>(std::chrono::nanoseconds(now - whole).count())};
  }
};
struct Logger {};

struct NodeOptions {
  std::map<std::string, std::any> parameters;
};

class Node {
 public:
  Node(std::string name, const NodeOptions& options) : name_(std::move(name)), options_(options) {}
  virtual ~Node() = default;

  template <class T>
  T declare_parameter(const std::string& name, const T& otherwise) {
    const auto given = options_.parameters.find(name);
    return given == options_.parameters.end() ? otherwise : std::any_cast<T>(given->second);
  }
  template <class M>
  typename Publisher<M>::SharedPtr create_publisher(const std::string& topic, const QoS&, const PublisherOptions& = {}) {
    return std::make_shared<Publisher<M>>(Publisher<M>{resolved(topic)});
  }
  template <class M>
  typename Subscription<M>::SharedPtr create_subscription(const std::string& topic, const QoS&,
                                                          const std::function<void(const std::shared_ptr<const M>&)>& callback) {
    StandInGraph::instance().listeners[resolved(topic)].push_back(
        [callback](const std::any& message) { callback(std::any_cast<std::shared_ptr<const M>>(message)); });
    return std::make_shared<Subscription<M>>();
  }
  template <class S>
  typename Service<S>::SharedPtr create_service(const std::string& name, const typename Service<S>::Call& call) {
    StandInGraph::instance().services[resolved(name)] = call;
    return std::make_shared<Service<S>>();
  }
  Clock::SharedPtr get_clock() { return std::make_shared<Clock>(); }
  Logger get_logger() const { return {}; }

 private:
  std::string resolved(const std::string& name) const { return name.starts_with("~/") ? "/" + name_ + name.substr(1) : name; }

  std::string name_;
  NodeOptions options_;
};

template <class... Values>
void warn(const Logger&, const char* format, const Values&...) {
  StandInGraph::instance().warnings.emplace_back(format);
}

}  // namespace rclcpp

// NOLINTBEGIN(cppcoreguidelines-macro-usage): ROS's are macros
#define RCLCPP_ERROR(logger, ...) rclcpp::warn(logger, __VA_ARGS__)
#define RCLCPP_WARN_THROTTLE(logger, clock, period_ms, ...) (static_cast<void>(clock), rclcpp::warn(logger, __VA_ARGS__))
#define RCLCPP_COMPONENTS_REGISTER_NODE(name) static_assert(std::is_base_of_v<rclcpp::Node, name>);
// NOLINTEND(cppcoreguidelines-macro-usage)
