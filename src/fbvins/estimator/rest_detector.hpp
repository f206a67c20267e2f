// SPDX-License-Identifier: Apache-2.0
// Is the body standing still? Compares the newest image with the first image of the rest, so that a
// slow drift, which frame-to-frame motion would hide, ends it; and looks at the gyroscope.
#pragma once

#include <unordered_map>

#include "fbvins/types/tracking.hpp"

namespace fbvins {

struct RestDetectorOptions {
  double max_motion_px = 0.6;  ///< median motion since the rest began
  double max_gyro_std_radps = 0.05;
  double max_accel_std_mps2 = 0.6;
  int min_features = 10;
};

class RestDetector {
 public:
  explicit RestDetector(const RestDetectorOptions& options = {}) : options_(options) {}

  /// Takes the next frame; returns how long the body has been at rest (zero when it moves).
  Duration update(const TrackedFrame& frame);
  void reset() { anchor_.clear(); }

 private:
  void start(const TrackedFrame& frame);
  bool imu_is_quiet(const ImuSegment& imu) const;

  RestDetectorOptions options_;
  Time since_;
  std::unordered_map<TrackId, Vec2> anchor_;  ///< pixels when the rest began
};

}  // namespace fbvins
