// SPDX-License-Identifier: Apache-2.0
// FB-VINS as a component of a ROS 2 process: images of a driver in the same container come without a copy. It takes images and
// readings, publishes odometry and transforms, and answers ~/reset; maps, records and the page are those of `fbvins live`
// (docs/ros2.md).
#include <chrono>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <builtin_interfaces/msg/time.hpp>
#include <diagnostic_msgs/msg/diagnostic_array.hpp>
#include <fbvins/camera/camera_times.hpp>
#include <fbvins/config/config_file.hpp>
#include <fbvins/io/dataset.hpp>
#include <fbvins/io/kalibr.hpp>
#include <fbvins/live/frame_joiner.hpp>
#include <fbvins/live/live_system.hpp>
#include <fbvins/mavlink/vehicle_frames.hpp>
#include <fbvins/types/motion_at.hpp>
#include <geometry_msgs/msg/transform_stamped.hpp>
#include <nav_msgs/msg/odometry.hpp>
#include <rclcpp/rclcpp.hpp>
#include <rclcpp_components/register_node_macro.hpp>
#include <sensor_msgs/image_encodings.hpp>
#include <sensor_msgs/msg/image.hpp>
#include <sensor_msgs/msg/imu.hpp>
#include <std_srvs/srv/trigger.hpp>
#include <tf2_msgs/msg/tf_message.hpp>

namespace fbvins_ros2 {
namespace {

using fbvins::Time;

Time time_of(const builtin_interfaces::msg::Time& stamp) { return Time{stamp.sec * 1'000'000'000LL + stamp.nanosec}; }

builtin_interfaces::msg::Time stamp_of(Time t) {
  builtin_interfaces::msg::Time stamp;
  stamp.sec = static_cast<std::int32_t>(t.ns / 1'000'000'000);
  stamp.nanosec = static_cast<std::uint32_t>(t.ns % 1'000'000'000);
  return stamp;
}

fbvins::Vec3 vector_of(const geometry_msgs::msg::Vector3& v) { return {v.x, v.y, v.z}; }

template <class To>
void put(To& to, const fbvins::Vec3& v) {
  to.x = v.x(), to.y = v.y(), to.z = v.z();
}
void put(geometry_msgs::msg::Quaternion& to, const fbvins::Quat& q) { to.w = q.w(), to.x = q.x(), to.y = q.y(), to.z = q.z(); }

template <class To>
void put(To& to, const fbvins::Mat6& covariance) {
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column) to[static_cast<std::size_t>(6 * row + column)] = covariance(row, column);
}

/// Reads the message's own pixels where its rows follow one another; it is kept as long as the image.
std::shared_ptr<const fbvins::Image> image_of(const sensor_msgs::msg::Image::ConstSharedPtr& message) {
  const int width = static_cast<int>(message->width), height = static_cast<int>(message->height);
  if (message->data.size() < std::size_t{message->step} * message->height || message->step < message->width) return nullptr;
  if (message->step == message->width)
    return std::make_shared<const fbvins::Image>(width, height,
                                                 std::shared_ptr<const std::uint8_t>(message, message->data.data()));
  auto copy = std::make_shared<fbvins::Image>(width, height);
  for (int y = 0; y < height; ++y)
    std::memcpy(copy->row(y), message->data.data() + static_cast<std::size_t>(y) * message->step, message->width);
  return copy;
}

/// Frames; an empty base_frame: there is no vehicle, and the odometry is that of the IMU.
struct Names {
  explicit Names(const fbvins::Ros2Options& options)
      : odometry(options.odometry_frame),
        imu(options.imu_frame),
        base(options.base_frame.empty() ? imu : options.base_frame),
        publish_tf(options.publish_tf) {}
  std::string odometry, imu, base;
  bool publish_tf;
};

geometry_msgs::msg::TransformStamped transform_of(const std::string& parent, const std::string& child, const fbvins::Vec3& p,
                                                  const fbvins::Quat& q, Time t = {}) {
  geometry_msgs::msg::TransformStamped out;
  out.header.stamp = stamp_of(t);
  out.header.frame_id = parent;
  out.child_frame_id = child;
  put(out.transform.translation, p);
  put(out.transform.rotation, q);
  return out;
}

/// What stands still: the IMU on the vehicle, and the cameras on the IMU.
tf2_msgs::msg::TFMessage fixed_transforms(const fbvins::StereoRig& rig, const Names& names,
                                          const fbvins::Pose<fbvins::B, fbvins::BaseLink>& T_B_base) {
  tf2_msgs::msg::TFMessage message;
  const auto T_base_B = T_B_base.inverse();
  if (names.base != names.imu) message.transforms.push_back(transform_of(names.base, names.imu, T_base_B.p, T_base_B.q));
  for (int c = 0; c < rig.camera_count(); ++c)
    message.transforms.push_back(
        transform_of(names.imu, "camera" + std::to_string(c) + "_optical", rig.T_BC(c).p, rig.T_BC(c).q));
  return message;
}

/// Covariances in ROS's axes: the pose's about those of the odometry's frame, the twist's about those of the body.
nav_msgs::msg::Odometry message_of(const fbvins::MotionAt<fbvins::BaseLink>& at, Time t, const Names& names) {
  const fbvins::Mat3 R = at.T_WX.R();
  fbvins::Mat6 to_W = fbvins::Mat6::Identity();
  to_W.bottomRightCorner<3, 3>() = R;
  fbvins::Mat6 twist = fbvins::Mat6::Zero();
  twist.topLeftCorner<3, 3>() = R.transpose() * at.velocity_covariance * R;
  nav_msgs::msg::Odometry message;
  message.header.stamp = stamp_of(t);
  message.header.frame_id = names.odometry;
  message.child_frame_id = names.base;
  put(message.pose.pose.position, at.T_WX.p);
  put(message.pose.pose.orientation, at.T_WX.q);
  put(message.pose.covariance, fbvins::Mat6(to_W * at.pose_covariance * to_W.transpose()));
  put(message.twist.twist.linear, fbvins::Vec3(R.transpose() * at.v_WX));
  put(message.twist.twist.angular, at.w_WX_X);
  put(message.twist.covariance, twist);
  return message;
}

/// What goes out, on a thread of its own.
class Output final : public fbvins::Sink {
 public:
  Output(rclcpp::Node& node, const fbvins::StereoRig& rig, const fbvins::Config& config)
      : names_(config.live.ros2),
        odometry_(node.create_publisher<nav_msgs::msg::Odometry>("~/odometry", rclcpp::QoS(10))),
        transforms_(node.create_publisher<tf2_msgs::msg::TFMessage>("/tf", rclcpp::QoS(100))),
        diagnostics_(node.create_publisher<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", rclcpp::QoS(10))),
        clock_(node.get_clock()) {
    if (names_.base != names_.imu) T_B_base_ = fbvins::base_link(config.live.mavlink.mounting);
    rclcpp::PublisherOptions between_processes;  // inside one process nothing can be kept for those who come later
    between_processes.use_intra_process_comm = rclcpp::IntraProcessSetting::Disable;
    fixed_ = node.create_publisher<tf2_msgs::msg::TFMessage>("/tf_static", rclcpp::QoS(1).transient_local(), between_processes);
    fixed_->publish(fixed_transforms(rig, names_, T_B_base_));
  }

  std::string_view name() const override { return "ros2"; }
  fbvins::Result<void> take(const fbvins::LiveEvent& event) override {
    if (const auto* pose = std::get_if<fbvins::LivePose>(&event)) publish(*pose);
    else if (const auto* status = std::get_if<fbvins::LiveStatus>(&event)) publish(*status);
    return {};
  }

 private:
  static constexpr fbvins::Duration kTransformPeriod{20'000'000};

  void publish(const fbvins::LivePose& pose) {
    if (!pose.health.has_pose()) return;
    const fbvins::MotionAt<fbvins::BaseLink> at = fbvins::motion_at(T_B_base_, pose);
    if (names_.publish_tf && (!told_ || pose.t < *told_ || pose.t - *told_ >= kTransformPeriod)) {
      told_ = pose.t;
      tf2_msgs::msg::TFMessage message;
      message.transforms.push_back(transform_of(names_.odometry, names_.base, at.T_WX.p, at.T_WX.q, pose.t));
      transforms_->publish(message);
    }
    nav_msgs::msg::Odometry message = message_of(at, pose.t, names_);
    if (told_resets_ && *told_resets_ != pose.reset_counter)  // as RTAB-Map takes it, and filters: no information
      for (auto* covariance : {&message.pose.covariance, &message.twist.covariance})
        put(*covariance, fbvins::Mat6(9999 * fbvins::Mat6::Identity()));
    told_resets_ = pose.reset_counter;
    odometry_->publish(message);
  }

  void publish(const fbvins::LiveStatus& status) {
    diagnostic_msgs::msg::DiagnosticArray message;
    message.header.stamp = clock_->now();
    diagnostic_msgs::msg::DiagnosticStatus& one = message.status.emplace_back();
    using State = fbvins::HealthState;
    const State state = status.health.state;
    one.level = state == State::good       ? diagnostic_msgs::msg::DiagnosticStatus::OK
                : state == State::degraded ? diagnostic_msgs::msg::DiagnosticStatus::WARN
                                           : diagnostic_msgs::msg::DiagnosticStatus::ERROR;
    one.name = "fbvins: live";
    one.message = status.problem.empty() ? std::string(to_string(status.health.reason)) : status.problem;
    status.counts.visit([&](const char* name, std::int64_t count) {
      diagnostic_msgs::msg::KeyValue& value = one.values.emplace_back();
      value.key = name;
      value.value = std::to_string(count);
    });
    diagnostics_->publish(message);
  }

  Names names_;
  fbvins::Pose<fbvins::B, fbvins::BaseLink> T_B_base_;
  std::optional<Time> told_;
  std::optional<std::uint32_t> told_resets_;
  rclcpp::Publisher<nav_msgs::msg::Odometry>::SharedPtr odometry_;
  rclcpp::Publisher<tf2_msgs::msg::TFMessage>::SharedPtr transforms_, fixed_;
  rclcpp::Publisher<diagnostic_msgs::msg::DiagnosticArray>::SharedPtr diagnostics_;
  rclcpp::Clock::SharedPtr clock_;
};

template <class T>
T checked(fbvins::Result<T> result) {
  if (!result) throw std::invalid_argument(result.error().message);
  return std::move(*result);
}

}  // namespace

class FbvinsComponent final : public rclcpp::Node {
 public:
  explicit FbvinsComponent(const rclcpp::NodeOptions& options) : Node("fbvins", options) {
    const auto images = declare_parameter<std::vector<std::string>>(
        "images", std::vector<std::string>{"/camera/camera/infra1/image_rect_raw", "/camera/camera/infra2/image_rect_raw"});
    const auto imu = declare_parameter<std::string>("imu", "/camera/camera/imu");
    const auto chain = declare_parameter<std::string>("calibration", "");
    const auto imu_noise = declare_parameter<std::string>("imu_calibration", "");
    const auto file = declare_parameter<std::string>("config", "");
    const auto assignments = declare_parameter<std::vector<std::string>>("set", std::vector<std::string>{});
    const auto tolerance_ms = declare_parameter<double>("pair_tolerance_ms", fbvins::DatasetOptions{}.pair_tolerance_ms);
    if (chain.empty()) throw std::invalid_argument("the parameter 'calibration' names no Kalibr camchain-imucam.yaml");
    const fbvins::Config config = checked(fbvins::load_config(file, assignments));
    rig_ = checked(fbvins::load_kalibr(chain, imu_noise.empty() ? std::nullopt : std::optional(imu_noise)));
    if (static_cast<int>(images.size()) != rig_.camera_count())
      throw std::invalid_argument("'images' has " + std::to_string(images.size()) + " topics, and " + chain + " " +
                                  std::to_string(rig_.camera_count()) + " cameras");
    if (!(tolerance_ms >= 0 && tolerance_ms <= 1000))
      throw std::invalid_argument("'pair_tolerance_ms' is " + std::to_string(tolerance_ms) + ", and not from 0 to 1000");
    live_.emplace(checked(fbvins::LiveSystem::create(config, config.live, rig_)));
    live_->add_sink(std::make_unique<Output>(*this, rig_, config));
    joiner_.emplace(rig_.camera_count(), false, fbvins::Duration::from_seconds(1e-3 * tolerance_ms), fbvins::own_offsets(rig_));
    for (std::size_t c = 0; c < images.size(); ++c)
      images_.push_back(create_subscription<sensor_msgs::msg::Image>(
          images[c], rclcpp::SensorDataQoS(),
          [this, camera = static_cast<int>(c)](const sensor_msgs::msg::Image::ConstSharedPtr& message) {
            take(camera, message);
          }));
    imu_ = create_subscription<sensor_msgs::msg::Imu>(
        imu, rclcpp::SensorDataQoS().keep_last(2000), [this](const sensor_msgs::msg::Imu::ConstSharedPtr& message) {
          live_->input().push(fbvins::ImuSample{time_of(message->header.stamp), vector_of(message->angular_velocity),
                                                vector_of(message->linear_acceleration)});
        });
    reset_ =
        create_service<std_srvs::srv::Trigger>("~/reset", [this](const std::shared_ptr<std_srvs::srv::Trigger::Request>&,
                                                                 const std::shared_ptr<std_srvs::srv::Trigger::Response>& reply) {
          live_->start_again();
          reply->success = true;
          reply->message = "the estimator starts again with the next image";
        });
  }

  ~FbvinsComponent() override {
    images_.clear();
    imu_.reset();
    if (const fbvins::Result<void> done = live_->finish(); !done) RCLCPP_ERROR(get_logger(), "%s", done.error().message.c_str());
  }

 private:
  void take(int camera, const sensor_msgs::msg::Image::ConstSharedPtr& message) {
    namespace encodings = sensor_msgs::image_encodings;
    const fbvins::Camera& own = rig_.camera(camera);
    const bool grey = message->encoding == encodings::MONO8 || message->encoding == encodings::TYPE_8UC1;
    const bool fits = static_cast<int>(message->width) == own.width() && static_cast<int>(message->height) == own.height();
    const std::shared_ptr<const fbvins::Image> image = grey && fits ? image_of(message) : nullptr;
    if (!image) {
      RCLCPP_WARN_THROTTLE(get_logger(), *get_clock(), 10'000,
                           "camera %d: images are %s of %u x %u; the calibration wants mono8 of %d x %d", camera,
                           message->encoding.c_str(), message->width, message->height, own.width(), own.height());
      return;
    }
    const std::lock_guard lock(mutex_);
    joiner_->add(camera, time_of(message->header.stamp), image);
    while (std::optional<fbvins::StereoFrame> frame = joiner_->next()) live_->input().push(std::move(*frame));
  }

  fbvins::StereoRig rig_;
  std::optional<fbvins::LiveSystem> live_;
  std::mutex mutex_;  ///< guards joiner_: a container may have several threads
  std::optional<fbvins::FrameJoiner> joiner_;
  std::vector<rclcpp::Subscription<sensor_msgs::msg::Image>::SharedPtr> images_;
  rclcpp::Subscription<sensor_msgs::msg::Imu>::SharedPtr imu_;
  rclcpp::Service<std_srvs::srv::Trigger>::SharedPtr reset_;
};

}  // namespace fbvins_ros2

RCLCPP_COMPONENTS_REGISTER_NODE(fbvins_ros2::FbvinsComponent)
