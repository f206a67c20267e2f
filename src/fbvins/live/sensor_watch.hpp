// SPDX-License-Identifier: Apache-2.0
// Detects silent cameras and a silent IMU, which the estimator cannot notice, and combines that with its last health.
// Pure functions of the times given.
#pragma once

#include "fbvins/live/ingest.hpp"
#include "fbvins/live/live_options.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

class SensorWatch {
 public:
  /// `longest_blind_s`: a pose propagated without images for longer is lost (estimator.max_image_gap_s).
  SensorWatch(const LiveOptions& options, double longest_blind_s) : options_(options), longest_blind_s_(longest_blind_s) {}

  /// The estimator's last health, and the time of its image.
  struct Estimated {
    Health health;
    std::optional<Time> image;  ///< on this machine's clock
  };

  /// The health at `host`; both times on this machine's clock. `started`: when sensor data were first expected. New images after
  /// a silence are not enough for good health: until the next estimate the pose is as old as the last one.
  Health judge(const Estimated& estimated, const Ingest::Arrival& arrivals, Time started, Time host) const;

 private:
  LiveOptions options_;
  double longest_blind_s_;
};

}  // namespace fbvins
