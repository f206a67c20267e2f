// SPDX-License-Identifier: Apache-2.0
// Publishes the flight in ROS 2: <node>/odometry (at IMU rate), /tf (odom -> base_link, map -> odom), /tf_static (the mounting
// and the cameras), <node>/path, /diagnostics. Conventions are those of a flight record (docs/flight_record.md); names of frames
// and the clock of the stamps are options.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "fbvins/camera/camera.hpp"
#include "fbvins/live/live_options.hpp"
#include "fbvins/live/sink.hpp"
#include "fbvins/mavlink/vehicle_frames.hpp"
#include "fbvins/ros2/ros2_node.hpp"
#include "fbvins/ros2/ros2_stamps.hpp"
#include "fbvins/types/motion_at.hpp"
#include "fbvins/types/trajectory.hpp"

namespace fbvins {

class Ros2Sink final : public Sink {
 public:
  static Result<std::unique_ptr<Ros2Sink>> create(const std::shared_ptr<Ros2Node>& node, const StereoRig& rig,
                                                  const LiveOptions& options = {});

  /// The name of a camera's frame: z ahead, x right.
  static std::string camera_frame(int camera);
  /// Of a depth sensor that lies elsewhere than camera 0.
  static constexpr std::string_view kDepthOptical = "depth_optical";

  std::string_view name() const override { return "ROS 2"; }
  Result<void> take(const LiveEvent& event) override;

 private:
  Ros2Sink(const LiveOptions& options, Ros2Publisher odometry, Ros2Publisher transforms, Ros2Publisher fixed, Ros2Publisher path,
           Ros2Publisher diagnostics);
  Result<void> take(const LivePose& pose);
  Result<void> take(const Odometry& odometry);
  Result<void> take(const LiveStatus& status);
  Result<void> publish_fixed(const StereoRig& rig);
  const std::string& base_frame() const { return options_.base_frame.empty() ? options_.imu_frame : options_.base_frame; }

  Ros2Options options_;
  Ros2Stamps stamps_;
  Pose<B, BaseLink> T_B_base_;
  Ros2Publisher odometry_, transforms_, fixed_, path_, diagnostics_;
  double reading_variance_ = 0;               // of one gyroscope reading, (rad/s)^2
  Mat3 rate_covariance_ = Mat3::Zero();       // of w_WB_B
  std::optional<MapUpdate> map_;              // the newest, if T_MW is known
  Trajectory<W> way_;                         // the path of base_link, a pose every kPathStep_m
  std::uint32_t reset_counter_ = 0;           // of the path
  std::optional<std::uint32_t> told_resets_;  // of the last odometry message
  std::optional<Time> transformed_, shown_;   // when the last of each was sent, in the messages' time
};

}  // namespace fbvins
