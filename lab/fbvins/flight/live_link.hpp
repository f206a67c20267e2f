// SPDX-License-Identifier: Apache-2.0
// The odometry in wall time, as on a vehicle: sensor data go through a socket source into a LiveSystem, and estimates come from
// one of its sinks with their real latency. Simulated time follows the machine's clock; on a machine that is too slow it falls
// behind, by WallTime::behind_s at most. Results differ from run to run.
//
//   Result<std::unique_ptr<OdometryLink>> link = LiveLink::create(setup, live_options, rig, 0.5);   // half of real time
//   (*link)->push(reading);                                                                    // waits until it is due
//   Result<std::vector<KnownEstimate>> known = (*link)->known_at(anything);                     // all that have come
#pragma once

#include <memory>

#include "fbvins/flight/estimator_link.hpp"
#include "fbvins/live/live_options.hpp"

namespace fbvins {

class LiveLink final : public OdometryLink {
 public:
  /// `setup.mode` is ignored: a live system has threads.
  static Result<std::unique_ptr<OdometryLink>> create(const EstimatorSetup& setup, const LiveOptions& options,
                                                      const StereoRig& rig, double rate);
  ~LiveLink() override;

  Result<void> push(SensorEvent event) override;
  Result<std::vector<KnownEstimate>> known_at(Time newest_image) override;
  Result<void> finish() override;
  std::optional<WallTime> wall_time() const override;

 private:
  struct Impl;
  explicit LiveLink(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace fbvins
