// SPDX-License-Identifier: Apache-2.0
// The newest estimate as outputs see it: carried on by readings, with the health that estimator and sensors have together.
// Any thread; no call waits for another one's work.
//
//   LiveEstimate estimate(propagator, watch, first_reset_counter, host_now());
//   if (auto pose = estimate.add(odometry, image_host_t)) publish(*pose);
//   if (auto pose = estimate.add(reading, host_t)) publish(*pose);
//   if (estimate.judge(ingest.arrivals(), host_now())) publish(status);      // health has changed
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>

#include "fbvins/live/latency_histogram.hpp"
#include "fbvins/live/pose_propagator.hpp"
#include "fbvins/live/sensor_watch.hpp"

namespace fbvins {

class LiveEstimate {
 public:
  /// `first_reset`: of the poses before the first estimate. `started`: as in SensorWatch::judge().
  LiveEstimate(PosePropagator propagator, const SensorWatch& watch, std::uint32_t first_reset, Time started)
      : propagator_(std::move(propagator)), watch_(watch), reset_counter_(first_reset), started_(started) {}

  /// The pose at a reading that came at `host_t`; none for one that is refused.
  std::optional<LivePose> add(const ImuSample& reading, Time host_t);
  /// An estimate, with the reset counter of the outputs; the pose at its image while no readings carry it on.
  std::optional<LivePose> add(const Odometry& estimate, Time image_host_t);
  /// Whether health is another one now.
  bool judge(const Ingest::Arrival& arrivals, Time host);
  /// Health, reset counter, what was counted here, and the age of the estimate at readings.
  void tell(LiveStatus& status) const;

 private:
  mutable std::mutex mutex_;
  PosePropagator propagator_;
  SensorWatch watch_;
  SensorWatch::Estimated estimated_;
  Health health_;  ///< SensorWatch's judgement of it
  std::uint32_t reset_counter_;
  std::int64_t images_ = 0, resets_ = 0;
  LatencyHistogram age_;
  Time started_;
};

}  // namespace fbvins
