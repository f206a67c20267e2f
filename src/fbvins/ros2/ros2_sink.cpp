// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_sink.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "fbvins/io/ros_messages.hpp"
#include "fbvins/live/live_diagnostic.hpp"
#include "fbvins/mavlink/vehicle_frames.hpp"

namespace fbvins {
namespace {

constexpr Duration kTransformPeriod{20'000'000};
constexpr Duration kPathPeriod{1'000'000'000};
constexpr double kPathStep_m = 0.05;
constexpr std::size_t kLongestPath = 10'000;  // poses, about 0.7 MB a message

/// Whether a period has passed, or time has gone back, since `last`, which is then set to `now`.
bool due(std::optional<Time>& last, Time now, Duration period) {
  if (last && now >= *last && now - *last < period) return false;
  last = now;
  return true;
}

Pose<B, BaseLink> base_of(const LiveOptions& options) {
  if (options.ros2.base_frame.empty()) return {};
  return base_link(options.mavlink.mounting);
}

Result<void> check_frames(const Ros2Options& options) {
  const std::array names = {options.map_frame, options.odometry_frame, options.base_frame, options.imu_frame};
  for (auto name = names.begin(); name != names.end(); ++name) {
    if (name->empty() && name == names.begin() + 2) continue;  // no base
    const bool odd = name->empty() || name->front() == '/' || name->find_first_of(" \t\n") != std::string::npos;
    if (odd)
      return Error{ErrorCode::invalid_argument,
                   fmt::format("ROS 2 frame '{}': a name without spaces, not beginning with /", *name)};
    if (std::find(names.begin(), name, *name) != name)
      return Error{ErrorCode::invalid_argument, fmt::format("ROS 2 frame '{}': two of live.ros2's frames have this name", *name)};
  }
  return {};
}

}  // namespace

Ros2Sink::Ros2Sink(const LiveOptions& options, Ros2Publisher odometry, Ros2Publisher transforms, Ros2Publisher fixed,
                   Ros2Publisher path, Ros2Publisher diagnostics)
    : options_(options.ros2),
      stamps_(options.ros2.clock),
      T_B_base_(base_of(options)),
      odometry_(std::move(odometry)),
      transforms_(std::move(transforms)),
      fixed_(std::move(fixed)),
      path_(std::move(path)),
      diagnostics_(std::move(diagnostics)) {}

Result<std::unique_ptr<Ros2Sink>> Ros2Sink::create(const std::shared_ptr<Ros2Node>& node, const StereoRig& rig,
                                                   const LiveOptions& options) {
  if (Result<void> named = check_frames(options.ros2); !named) return named.error();
  auto odometry = Ros2Publisher::create(node, node->own_topic("odometry"), "nav_msgs/msg/Odometry");
  if (!odometry) return odometry.error();
  auto transforms = Ros2Publisher::create(node, "/tf", "tf2_msgs/msg/TFMessage", {.depth = 100});
  if (!transforms) return transforms.error();
  auto fixed = Ros2Publisher::create(node, "/tf_static", "tf2_msgs/msg/TFMessage", {.latched = true, .depth = 1});
  if (!fixed) return fixed.error();
  auto path = Ros2Publisher::create(node, node->own_topic("path"), "nav_msgs/msg/Path", {.latched = true, .depth = 1});
  if (!path) return path.error();
  auto diagnostics = Ros2Publisher::create(node, "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray");
  if (!diagnostics) return diagnostics.error();
  std::unique_ptr<Ros2Sink> sink(new Ros2Sink(options, std::move(*odometry), std::move(*transforms), std::move(*fixed),
                                              std::move(*path), std::move(*diagnostics)));
  const ImuNoise& noise = rig.imu_noise;
  sink->reading_variance_ = noise.gyro_noise_density_radps_rthz * noise.gyro_noise_density_radps_rthz * noise.rate_hz;
  if (Result<void> published = sink->publish_fixed(rig); !published) return published.error();
  return sink;
}

std::string Ros2Sink::camera_frame(int camera) { return fmt::format("camera{}_optical", camera); }

/// What is latched is kept by DDS, so that once is enough.
Result<void> Ros2Sink::publish_fixed(const StereoRig& rig) {
  std::vector<std::string> names;
  for (int c = 0; c < rig.camera_count(); ++c) names.push_back(camera_frame(c));
  const Pose<BaseLink, B> T_base_B = T_B_base_.inverse();
  std::vector<RosTransform> transforms;
  if (!options_.base_frame.empty()) transforms.push_back({options_.base_frame, options_.imu_frame, T_base_B.q, T_base_B.p});
  for (int c = 0; c < rig.camera_count(); ++c) {
    const auto T_BC = rig.T_BC(c);
    transforms.push_back({options_.imu_frame, names[static_cast<std::size_t>(c)], T_BC.q, T_BC.p});
  }
  if (const auto& depth = rig.depth; depth && depth->own)
    transforms.push_back({options_.imu_frame, kDepthOptical, depth->own->T_BC.q, depth->own->T_BC.p});
  std::string message;
  append_transforms(message, Time{}, transforms);
  return fixed_.publish(std::move(message));
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
  stamps_.compare(pose.t, pose.host_t);
  if (!pose.health.has_pose() || !stamps_.known(pose.t)) return {};
  const Time t = stamps_.of(pose.t);
  const MotionAt<BaseLink> at = motion_at(T_B_base_, pose);
  const Mat3 R_base_B = T_B_base_.R().transpose();
  const bool after_reset = told_resets_ && *told_resets_ != pose.reset_counter;
  told_resets_ = pose.reset_counter;
  std::string message;
  append_odometry(message,
                  {t, at.T_WX.cast_frames<W, B>(), at.v_WX, at.w_WX_X, at.pose_covariance, at.velocity_covariance,
                   R_base_B * rate_covariance_ * R_base_B.transpose(), options_.odometry_frame, base_frame(), after_reset});
  if (Result<void> sent = odometry_.publish(std::move(message)); !sent) return sent;
  if (!options_.publish_tf || !due(transformed_, t, kTransformPeriod)) return {};
  const bool in_map = map_ && map_->reset_counter == pose.reset_counter;
  const Pose<M, W> T_MW = in_map ? map_->T_MW : Pose<M, W>{};
  const std::array transforms = {RosTransform{options_.odometry_frame, base_frame(), at.T_WX.q, at.T_WX.p},
                                 RosTransform{options_.map_frame, options_.odometry_frame, T_MW.q, T_MW.p}};
  message.clear();
  append_transforms(message, t, std::span(transforms).first(in_map ? 2 : 1));
  return transforms_.publish(std::move(message));
}

Result<void> Ros2Sink::take(const Odometry& o) {
  rate_covariance_ = o.gyro_bias_covariance + reading_variance_ * Mat3::Identity();
  if (!o.health.has_pose() || !stamps_.known(o.t)) return {};
  const Time t = stamps_.of(o.t);
  const Pose<W, B> T = (o.T_WB * T_B_base_).cast_frames<W, B>();
  if (o.reset_counter != reset_counter_) way_.clear();
  reset_counter_ = o.reset_counter;
  if (way_.empty() || (T.p - way_.back().T.p).norm() >= kPathStep_m) way_.push_back({t, T});
  if (way_.size() > kLongestPath) way_.erase(way_.begin(), way_.begin() + kLongestPath / 10);
  if (!due(shown_, t, kPathPeriod)) return {};
  std::string message;
  append_path(message, t, way_, options_.odometry_frame);
  return path_.publish(std::move(message));
}

Result<void> Ros2Sink::take(const LiveStatus& status) {
  const Time t = stamps_.of(status.t, status.host_t);
  if (status.t.ns == 0 || t.ns < 0 || t >= ros_time_end()) return {};  // no sensor data yet
  RosDiagnostic diagnostic = diagnostic_of(status);
  diagnostic.name = "fbvins: " + diagnostic.name;
  std::string message;
  append_diagnostics(message, t, {&diagnostic, 1});
  return diagnostics_.publish(std::move(message));
}

}  // namespace fbvins
