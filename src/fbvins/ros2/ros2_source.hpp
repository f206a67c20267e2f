// SPDX-License-Identifier: Apache-2.0
// Sensors from ROS 2 topics: sensor_msgs/Image of one to eight cameras (mono8) and of a depth sensor (16UC1), and
// sensor_msgs/Imu, with the reliability that their publishers offer. Publishers may come and go.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "fbvins/camera/camera_times.hpp"
#include "fbvins/live/frame_joiner.hpp"
#include "fbvins/live/make_source.hpp"
#include "fbvins/live/source.hpp"
#include "fbvins/ros2/ros2_node.hpp"

namespace fbvins {

struct RosImage;

struct Ros2Topics {
  std::vector<std::string> cameras;
  std::string imu;
  std::string depth = {};  ///< of a depth sensor that is registered to the one camera; empty: none
};
/// CAM0[,CAM1,...],IMU[,depth=DEPTH]: names of topics, each beginning with /.
Result<Ros2Topics> parse_ros2_topics(const std::string& text);

class Ros2Source final : public Source {
 public:
  /// The calibration is a Kalibr file's (`options.dataset`): no topic carries a complete one.
  static Result<std::unique_ptr<Ros2Source>> open(std::shared_ptr<Ros2Node> node, const Ros2Topics& topics,
                                                  const SourceOptions& options);

  const StereoRig& rig() const override { return rig_; }
  Result<void> run(SensorInput& input) override;
  void stop() override { stopped_ = true; }

 private:
  Ros2Source(std::shared_ptr<Ros2Node> node, Ros2Topics topics, SourceOptions options, StereoRig rig)
      : node_(std::move(node)),
        topics_(std::move(topics)),
        options_(std::move(options)),
        rig_(std::move(rig)),
        joiner_(rig_.camera_count(), !topics_.depth.empty(), Duration::from_seconds(1e-3 * options_.dataset.pair_tolerance_ms),
                own_offsets(rig_)) {}
  void take_image(int camera, std::string_view bytes, const std::shared_ptr<const void>& keeper, SensorInput& input);
  void take_depth(std::string_view bytes, SensorInput& input);
  bool is_of(const RosImage& image, const std::string& topic, const Camera& camera);
  void take_imu(std::string_view bytes, SensorInput& input);
  void say_once(const std::string& sentence);

  std::shared_ptr<Ros2Node> node_;
  Ros2Topics topics_;
  SourceOptions options_;
  StereoRig rig_;
  std::atomic<bool> stopped_ = false;
  std::mutex images_mutex_, say_mutex_;
  FrameJoiner joiner_;
  std::set<std::string> said_;
};

}  // namespace fbvins
