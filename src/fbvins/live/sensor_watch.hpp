// SPDX-License-Identifier: Apache-2.0
// What the estimator cannot say because nothing reaches it: that a camera or the IMU is silent. Joined with what it said last.
// Pure functions of the times given.
#pragma once

#include "fbvins/live/ingest.hpp"
#include "fbvins/live/live_options.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

class SensorWatch {
 public:
  /// `longest_blind_s`: a pose carried on without images for longer is lost (estimator.max_image_gap_s).
  SensorWatch(const LiveOptions& options, double longest_blind_s) : options_(options), longest_blind_s_(longest_blind_s) {}

  /// What the estimator said last, and of the image of when.
  struct Estimated {
    Health health;
    std::optional<Time> image;  ///< on this machine's clock
  };

  /// The health at `host`, on this machine's clock. `started` is when sensors were first listened to. Images that come again
  /// after a silence are not enough: the pose is as old as its estimate until the next one.
  Health judge(const Estimated& estimated, const Ingest::Arrival& arrivals, Time started, Time host) const;

 private:
  LiveOptions options_;
  double longest_blind_s_;
};

}  // namespace fbvins
