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

  /// The health at `host`, on this machine's clock. `started` is when sensors were first listened to.
  Health judge(const Health& estimated, const Ingest::Arrival& arrivals, Time started, Time host) const;

 private:
  LiveOptions options_;
  double longest_blind_s_;
};

}  // namespace fbvins
