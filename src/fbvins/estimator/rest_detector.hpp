// SPDX-License-Identifier: Apache-2.0
// Whether the body stands still. Compares the newest image with the first one of the rest, so that slow
// drift ends it, which motion from frame to frame would not show; and the IMU's readings must be quiet.
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
  void reset() { reference_.clear(); }

 private:
  void start(const TrackedFrame& frame);
  bool imu_is_quiet(const ImuSegment& imu) const;

  RestDetectorOptions options_;
  Time since_;
  struct Sight {
    int camera;
    Vec2 pixel;
  };
  using Sights = FixedList<Sight, kMostCameras>;
  std::unordered_map<TrackId, Sights> reference_;  ///< at the beginning of the rest
};

}  // namespace fbvins
