// SPDX-License-Identifier: Apache-2.0
// Linux video devices (V4L2), one a camera, or one with the images of all cameras side by side, and an IMU from elsewhere
// (docs/devices.md).
//
//   auto source = V4l2Source::open("/dev/video0,/dev/video2,serial:/dev/ttyS4:921600", options);
//   Result<void> end = (*source)->run(live.input());    // until stop(); a device that is unplugged is waited for
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/live/frame_joiner.hpp"
#include "fbvins/live/make_source.hpp"
#include "fbvins/live/wake_event.hpp"
#include "fbvins/v4l2/imu_feed.hpp"
#include "fbvins/v4l2/video_device.hpp"

namespace fbvins {

struct V4l2Devices {
  std::vector<std::string> cameras;  ///< one of each camera, or one with all images side by side
  std::string imu;                   ///< for ImuFeed::open()
};
/// DEVICE[,DEVICE ...],IMU.
Result<V4l2Devices> parse_v4l2_devices(const std::string& text);

class V4l2Source final : public Source {
 public:
  /// The calibration is Kalibr's, with the IMU's noise (`options.dataset`). Devices that are not there are waited for in run().
  static Result<std::unique_ptr<V4l2Source>> open(const std::string& devices, const SourceOptions& options);

  const StereoRig& rig() const override { return rig_; }
  Result<void> run(SensorInput& input) override;
  void stop() override;

 private:
  struct Opened {
    std::string path;
    std::optional<VideoDevice> device = std::nullopt;
    Time next_try{};
  };
  V4l2Source(V4l2Devices devices, SourceOptions options, StereoRig rig);
  bool is_side_by_side() const { return cameras_.size() == 1 && rig_.camera_count() > 1; }
  void deliver_images(SensorInput& input);
  void keep_open(Opened& camera);
  void take(std::size_t index, SensorInput& input);
  void add(std::size_t index, VideoFrame frame, SensorInput& input);
  void say(const std::string& sentence);

  SourceOptions options_;
  StereoRig rig_;
  std::vector<Opened> cameras_;
  std::unique_ptr<ImuFeed> imu_;
  FrameJoiner joiner_;
  const WakeEvent wake_;
  std::mutex say_mutex_;
  std::atomic<bool> stopped_ = false;
};

}  // namespace fbvins
