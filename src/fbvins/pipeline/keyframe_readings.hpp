// SPDX-License-Identifier: Apache-2.0
// IMU readings from keyframe to keyframe, for the receivers of keyframes: gathered frame by frame, handed out when a keyframe
// has become final, some frames later. One thread at a time.
//
//   readings.add(frame.imu);                                       // every frame, in order
//   keyframe.imu.segments = readings.until(keyframe.t);            // every keyframe, in order
#pragma once

#include <deque>
#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

class KeyframeReadings {
 public:
  void add(const ImuSegment& segment);
  /// Consecutive segments since the keyframe before; none where some are missing.
  std::vector<ImuSegment> until(Time t);

 private:
  std::deque<ImuSegment> segments_;
  Time handed_out_until_{};
};

}  // namespace fbvins
