// SPDX-License-Identifier: Apache-2.0
// Publishes what the flight sees: <node>/camera0/image_raw and camera_info (each camera), <node>/depth/image_raw, and
// <node>/landmarks. Each only while somebody has subscribed it: without subscribers nothing is encoded, and the estimator makes
// no view. A sink beside Ros2Sink, so that large messages to a slow network hold up no pose.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/live/live_options.hpp"
#include "fbvins/live/sink.hpp"
#include "fbvins/ros2/ros2_node.hpp"
#include "fbvins/ros2/ros2_stamps.hpp"

namespace fbvins {

class Ros2ImageSink final : public Sink {
 public:
  static Result<std::unique_ptr<Ros2ImageSink>> create(const std::shared_ptr<Ros2Node>& node, const StereoRig& rig,
                                                       const Ros2Options& options = {});

  std::string_view name() const override { return "ROS 2 images"; }
  bool wants_views() const override { return landmarks_.subscribers() > 0; }
  Result<void> take(const LiveEvent& event) override;

 private:
  struct CameraTopics {
    Camera camera;
    std::string frame;
    Ros2Publisher image, info;
  };
  Ros2ImageSink(const Ros2Options& options, Ros2Publisher landmarks)
      : odometry_frame_(options.odometry_frame), stamps_(options.clock), landmarks_(std::move(landmarks)) {}
  Result<void> take(const StereoFrame& frame);
  Result<void> take(const LiveView& view);

  std::string odometry_frame_;
  Ros2Stamps stamps_;
  Ros2Publisher landmarks_;
  std::vector<CameraTopics> cameras_;
  std::optional<Ros2Publisher> depth_;       ///< of a rig with a depth sensor
  std::optional<Ros2Publisher> depth_info_;  ///< of one that lies elsewhere
  Camera depth_camera_;
};

}  // namespace fbvins
