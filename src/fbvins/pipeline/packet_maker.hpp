// SPDX-License-Identifier: Apache-2.0
// Joins each stereo image with the IMU readings since the image before it. An image waits until the
// readings reach its stamp, but not for ever: an IMU that falls silent must not silence the cameras.
#pragma once

#include <deque>
#include <optional>

#include "fbvins/imu/imu_buffer.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

struct PacketMakerOptions {
  double max_imu_wait_s = 0.25;
  ImuBufferOptions imu_buffer;

  template <class V>
  void visit(V&& v) {
    v("max_imu_wait_s", max_imu_wait_s, "s", "an image goes on without its IMU readings when newer images are ahead by this", 0.0,
      10.0);
    v.group("imu_buffer", imu_buffer, "IMU readings on their way to the images");
  }
};

/// What became of the input.
struct InputCounts {
  ImuBufferCounts imu;
  int images = 0;
  int images_backward = 0;  ///< stamp not after the image before: skipped
};

class PacketMaker {
 public:
  /// time_offset: t_imu = t_image + offset.
  PacketMaker(const PacketMakerOptions& options, Duration time_offset)
      : options_(options), offset_(time_offset), imu_(options.imu_buffer) {}

  void push(const ImuSample& sample) { imu_.push(sample); }
  void push(StereoFrame frame);
  /// The next image that is ready; with `flush`, the next image even if its readings never came.
  std::optional<SensorPacket> next(bool flush = false);
  InputCounts counts() const;

 private:
  PacketMakerOptions options_;
  Duration offset_;
  ImuBuffer imu_;
  std::deque<StereoFrame> waiting_;
  std::optional<Time> newest_image_, previous_image_;  ///< on the IMU's clock
  std::int64_t next_frame_ = 0;
  int backward_ = 0;
};

}  // namespace fbvins
