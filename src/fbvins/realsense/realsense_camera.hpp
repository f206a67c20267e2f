// SPDX-License-Identifier: Apache-2.0
// One RealSense camera with an IMU, plugged in or played from a file: its factory calibration, and its streams as sensor events.
// Left and right infrared, or the left one and the depth images that the device makes of both, emitter off; gyroscope and
// accelerometer as one IMU, which is B; stamps in the library's global time, the same for all streams. The library's exceptions
// become Errors.
#pragma once

#include <array>
#include <functional>
#include <librealsense2/rs.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/imu/motion_merge.hpp"
#include "fbvins/live/device_facts.hpp"
#include "fbvins/live/frame_joiner.hpp"
#include "fbvins/live/source.hpp"

namespace fbvins {

/// The factory calibration of both cameras and the IMU; the IMU's noise is the data sheet's. An error where a stream's lens model
/// is not supported. Where `second` is the stream of depth images the rig is one of the left camera with a depth sensor, whose
/// noise follows from `baseline_m`.
Result<StereoRig> realsense_rig(const rs2::video_stream_profile& left, const rs2::video_stream_profile& second,
                                const rs2::motion_stream_profile& gyro, double baseline_m);

/// Size and rate of the images that are wanted; 0: whatever is nearest to 640 x 480 at 30 Hz. `depth`: depth images in the place
/// of the right ones.
struct RealsenseMode {
  int width_px = 0, height_px = 0, rate_hz = 0;
  bool depth = false;
};

/// What images say of themselves, where driver and firmware pass it on.
struct RealsenseSeen {
  std::optional<double> exposure_ms;  ///< of the newest
  bool emitter_on = false, emitter_off = false;
  int clock = -1;  ///< the first stamp's domain (rs2_timestamp_domain); -1: none yet
};

/// Name, firmware, connection, settings of the device; `stereo`: the sensor of its infrared cameras.
DeviceFacts realsense_facts(const rs2::device& device, const rs2::sensor& stereo, const RealsenseSeen& seen);

/// False where scale and biases are those of an IMU that nobody has calibrated.
bool is_calibrated(const rs2::motion_stream_profile& gyro, const rs2::motion_stream_profile& accel);

class RealsenseCamera {
 public:
  using Say = std::function<void(const std::string&)>;

  /// Chooses streams and sets options; nothing is delivered yet. An error where the device has not the wanted mode names those
  /// that it has.
  static Result<std::unique_ptr<RealsenseCamera>> open(rs2::device device, Say say, RealsenseMode wanted = {});
  ~RealsenseCamera() { stop(); }

  /// The factory calibration; an error where the device has none that is supported, so that Kalibr's is needed.
  const Result<StereoRig>& rig() const { return rig_; }
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  const rs2::device& device() const { return device_; }
  /// Delivers on the library's threads until stop(), with the images that `pairs` joins.
  Result<void> start(SensorInput& input, FrameJoiner pairs = FrameJoiner(2));
  void stop();
  /// Since its start or its last image, on this machine's clock.
  Duration silence();
  /// Of the images since its start, FrameJoiner::report(); after stop().
  std::string unpaired();
  /// What is known of the device now; of one that is unplugged what can still be had.
  DeviceFacts facts();

 private:
  /// A sensor of the device, and the streams that are used.
  struct Stream {
    rs2::sensor sensor;
    std::vector<rs2::stream_profile> profiles = {};
    bool started = false;
    bool is_stereo = false;
  };
  RealsenseCamera(rs2::device device, Say say, RealsenseMode wanted)
      : device_(std::move(device)), say_(std::move(say)), wanted_(wanted) {}
  Result<void> choose();
  void note_mode(const rs2::stream_profile& profile);
  std::string modes(bool only_usual) const;
  void set_options();
  void take(const rs2::frame& frame, SensorInput& input);
  void take_image(const rs2::video_frame& frame, Time t, SensorInput& input);
  std::shared_ptr<const DepthImage> depth_of(const rs2::video_frame& frame) const;
  void take_motion(const rs2::motion_frame& frame, Time t, SensorInput& input);
  void say_once(const std::string& sentence);

  rs2::device device_;
  Say say_;
  RealsenseMode wanted_;
  std::set<std::array<int, 3>> modes_;  ///< of the left camera: width, height, rate
  std::string mode_;                    ///< that is used
  bool imu_calibrated_ = false;
  Result<StereoRig> rig_ = StereoRig{};
  int width_px_ = 0, height_px_ = 0;
  double unit_mm_ = 1;  ///< of the depth images' values
  std::vector<Stream> streams_;
  std::mutex mutex_;  // guards what follows: each sensor has a thread of its own
  FrameJoiner pairs_{2};
  MotionMerge motion_;
  RealsenseSeen seen_;
  Time heard_;  ///< when it was started, or its last image came, by host_now()
  std::set<std::string> said_;
};

/// The serial number, or the name of the file that is played.
std::string realsense_name(const rs2::device& device);

}  // namespace fbvins
