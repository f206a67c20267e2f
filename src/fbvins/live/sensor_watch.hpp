// SPDX-License-Identifier: Apache-2.0
// Detects silent cameras and a silent IMU, which the estimator cannot notice, and combines that with its last health.
// Pure functions of the times given.
#pragma once

#include "fbvins/estimator/estimator_options.hpp"
#include "fbvins/live/ingest.hpp"
#include "fbvins/live/live_options.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

class SensorWatch {
 public:
  /// `estimator`: what is lost, max_blind_m by the IMU alone, and max_imu_gap_s without images and readings.
  SensorWatch(const LiveOptions& options, const EstimatorOptions& estimator)
      : options_(options), max_blind_m_(estimator.max_blind_m), max_imu_gap_s_(estimator.max_imu_gap_s) {}

  /// The estimator's last health, and the time of its image.
  struct Estimated {
    Health health;
    std::optional<Time> image;  ///< on this machine's clock
    double sigma_m = 0;         ///< worst_sigma_m of its pose
    double newest_sigma_m = 0;  ///< and of that pose, propagated to the newest reading
  };

  /// The health at `host`; both times on this machine's clock. `started`: when sensor data were first expected. New images after
  /// a silence are not enough for good health: until the next estimate the pose is as old as the last one.
  Health judge(const Estimated& estimated, const Ingest::Arrival& arrivals, Time started, Time host) const;

 private:
  LiveOptions options_;
  double max_blind_m_, max_imu_gap_s_;
};

}  // namespace fbvins
