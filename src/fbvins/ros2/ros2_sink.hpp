// SPDX-License-Identifier: Apache-2.0
// Publishes the flight in ROS 2: /fbvins/odometry (at IMU rate), /tf (odom -> body, map -> odom), /fbvins/path, /diagnostics.
// Frames and conventions are those of a flight record (docs/flight_record.md), stamps the sensors' own.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "fbvins/live/sink.hpp"
#include "fbvins/ros2/ros2_node.hpp"
#include "fbvins/types/trajectory.hpp"

namespace fbvins {

class Ros2Sink final : public Sink {
 public:
  static Result<std::unique_ptr<Ros2Sink>> create(const std::shared_ptr<Ros2Node>& node, const ImuNoise& noise);

  std::string_view name() const override { return "ROS 2"; }
  Result<void> take(const LiveEvent& event) override;

 private:
  Ros2Sink(Ros2Publisher odometry, Ros2Publisher transforms, Ros2Publisher path, Ros2Publisher diagnostics)
      : odometry_(std::move(odometry)),
        transforms_(std::move(transforms)),
        path_(std::move(path)),
        diagnostics_(std::move(diagnostics)) {}
  Result<void> take(const LivePose& pose);
  Result<void> take(const Odometry& odometry);
  Result<void> take(const LiveStatus& status);

  Ros2Publisher odometry_, transforms_, path_, diagnostics_;
  double reading_variance_ = 0;              // of one gyroscope reading, (rad/s)^2
  Mat3 rate_covariance_ = Mat3::Zero();      // of w_WB_B
  std::optional<MapUpdate> map_;             // the newest, if T_MW is known
  Trajectory<W> way_;                        // the path, a pose every kPathStep_m
  std::uint32_t reset_counter_ = 0;          // of the path
  std::optional<Time> transformed_, shown_;  // when the last of each was sent, sensors' time
};

}  // namespace fbvins
