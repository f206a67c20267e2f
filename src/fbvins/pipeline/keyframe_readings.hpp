// SPDX-License-Identifier: Apache-2.0
// IMU readings from keyframe to keyframe, for the receivers of keyframes: gathered frame by frame, handed out when a keyframe
// has become final, some frames later. One thread at a time.
//
//   readings.add(frame.imu);                                       // every frame, in order
//   keyframe.imu.segments = readings.until(keyframe.t);            // every keyframe, in order
//   readings.take_back(std::move(keyframe.imu.segments));          // a keyframe that nobody takes
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
  /// Of the last call of until(): the keyframe was left out, and the next one gets them.
  void take_back(std::vector<ImuSegment> segments);

 private:
  void drop_old();

  std::deque<ImuSegment> segments_;
  Time handed_out_until_{}, handed_out_before_{};
};

}  // namespace fbvins
