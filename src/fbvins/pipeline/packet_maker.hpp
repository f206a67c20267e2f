// SPDX-License-Identifier: Apache-2.0
// Joins each stereo image with the IMU readings since the image before it. An image waits until the
// readings reach its stamp, but for a limited time, so that a silent IMU does not block the images. Images that repeat an earlier
// one are left out.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "fbvins/imu/imu_history.hpp"
#include "fbvins/pipeline/repeated_images.hpp"
#include "fbvins/types/input_counts.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

class PacketMaker {
 public:
  /// time_offset: t_imu = t_image + offset. What comes out is on the images' clock.
  PacketMaker(const ImuNoise& imu, Duration time_offset)
      : imu_(imu, time_offset), given_(time_offset), time_offset_(time_offset) {}

  void push(const ImuSample& sample) { imu_.add(sample); }
  void push(StereoFrame frame);
  /// Goes with the next image that comes out.
  void push(Anchor anchor);
  /// Goes with the first image that comes out and is not older.
  void push(const AidingSample& reading);
  /// The next image that is ready; with `flush`, the next image even if its readings never came.
  std::optional<SensorPacket> next(bool flush = false);
  /// The number of the next image, where one waits and could come out.
  std::optional<FrameId> next_id(bool flush = false) const;
  /// What the given time offset is corrected by, from the next image on.
  void correct_time_offset(Duration by);
  InputCounts counts() const;

 private:
  bool is_ready(bool flush) const;

  ImuHistory imu_;
  RepeatedImageFilter repeated_;
  Duration given_, time_offset_;
  std::deque<StereoFrame> waiting_;
  std::vector<Anchor> anchors_;
  std::deque<AidingSample> aiding_;
  std::optional<Time> newest_image_;
  std::optional<Time> previous_;  ///< when the image before was taken, by the time offset of now
  std::int64_t next_frame_ = 0;
  int backward_ = 0;
};

}  // namespace fbvins
