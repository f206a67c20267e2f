// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_sink.hpp"

#include <array>
#include <utility>

#include "fbvins/io/ros_messages.hpp"
#include "fbvins/live/live_diagnostic.hpp"

namespace fbvins {
namespace {

constexpr Duration kTransformPeriod{20'000'000};
constexpr Duration kPathPeriod{1'000'000'000};
constexpr double kPathStep_m = 0.05;
constexpr std::size_t kLongestPath = 10'000;  // poses, about 0.7 MB a message

/// Range of ROS's stamps.
bool can_be_said(Time t) { return t.ns >= 0 && t < ros_time_end(); }

/// Whether a period has passed, or time has gone back, since `last`, which is then set to `now`.
bool due(std::optional<Time>& last, Time now, Duration period) {
  if (last && now >= *last && now - *last < period) return false;
  last = now;
  return true;
}

}  // namespace

Result<std::unique_ptr<Ros2Sink>> Ros2Sink::create(const std::shared_ptr<Ros2Node>& node, const ImuNoise& noise) {
  auto odometry = Ros2Publisher::create(node, "/fbvins/odometry", "nav_msgs/msg/Odometry");
  if (!odometry) return odometry.error();
  auto transforms = Ros2Publisher::create(node, "/tf", "tf2_msgs/msg/TFMessage", {.depth = 100});
  if (!transforms) return transforms.error();
  auto path = Ros2Publisher::create(node, "/fbvins/path", "nav_msgs/msg/Path", {.latched = true, .depth = 1});
  if (!path) return path.error();
  auto diagnostics = Ros2Publisher::create(node, "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray");
  if (!diagnostics) return diagnostics.error();
  std::unique_ptr<Ros2Sink> sink(
      new Ros2Sink(std::move(*odometry), std::move(*transforms), std::move(*path), std::move(*diagnostics)));
  sink->reading_variance_ = noise.gyro_noise_density_radps_rthz * noise.gyro_noise_density_radps_rthz * noise.rate_hz;
  return sink;
}

Result<void> Ros2Sink::take(const LiveEvent& event) {
  if (const auto* pose = std::get_if<LivePose>(&event)) return take(*pose);
  if (const auto* odometry = std::get_if<Odometry>(&event)) return take(*odometry);
  if (const auto* status = std::get_if<LiveStatus>(&event)) return take(*status);
  if (const auto* update = std::get_if<MapUpdate>(&event)) {
    map_.reset();
    if (update->localised) map_ = *update;
  }
  return {};
}

Result<void> Ros2Sink::take(const LivePose& pose) {
  if (!pose.health.has_pose() || !can_be_said(pose.t)) return {};
  std::string message;
  append_odometry(message,
                  {pose.t, pose.T_WB, pose.v_WB, pose.w_WB_B, pose.pose_covariance, pose.velocity_covariance, rate_covariance_});
  if (Result<void> sent = odometry_.publish(std::move(message)); !sent) return sent;
  if (!due(transformed_, pose.t, kTransformPeriod)) return {};
  const bool in_map = map_ && map_->reset_counter == pose.reset_counter;
  const Pose<M, W> T_MW = in_map ? map_->T_MW : Pose<M, W>{};
  const std::array transforms = {RosTransform{kOdometryFrame, kBodyFrame, pose.T_WB.q, pose.T_WB.p},
                                 RosTransform{kMapFrame, kOdometryFrame, T_MW.q, T_MW.p}};
  message.clear();
  append_transforms(message, pose.t, std::span(transforms).first(in_map ? 2 : 1));
  return transforms_.publish(std::move(message));
}

Result<void> Ros2Sink::take(const Odometry& o) {
  rate_covariance_ = o.gyro_bias_covariance + reading_variance_ * Mat3::Identity();
  if (!o.health.has_pose() || !can_be_said(o.t)) return {};
  if (o.reset_counter != reset_counter_) way_.clear();
  reset_counter_ = o.reset_counter;
  if (way_.empty() || (o.T_WB.p - way_.back().T.p).norm() >= kPathStep_m) way_.push_back({o.t, o.T_WB});
  if (way_.size() > kLongestPath) way_.erase(way_.begin(), way_.begin() + kLongestPath / 10);
  if (!due(shown_, o.t, kPathPeriod)) return {};
  std::string message;
  append_path(message, o.t, way_);
  return path_.publish(std::move(message));
}

Result<void> Ros2Sink::take(const LiveStatus& status) {
  if (status.t.ns == 0 || !can_be_said(status.t)) return {};  // no sensor data yet
  RosDiagnostic diagnostic = diagnostic_of(status);
  diagnostic.name = "fbvins: " + diagnostic.name;
  std::string message;
  append_diagnostics(message, status.t, {&diagnostic, 1});
  return diagnostics_.publish(std::move(message));
}

}  // namespace fbvins
