// SPDX-License-Identifier: Apache-2.0
// The odometry in lockstep with simulated time: the estimate of an image becomes available a fixed time after the image,
// whatever the speed of the machine. One owner; the odometry may have threads of its own, with the same result.
//
//   Result<std::unique_ptr<OdometryLink>> link = EstimatorLink::create(setup, rig);
//   (*link)->push(reading);
//   Result<std::vector<KnownEstimate>> known = (*link)->known_at(reading.t - delay);
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/flight/odometry_link.hpp"
#include "fbvins/pipeline/system.hpp"

namespace fbvins {

struct EstimatorSetup {
  SystemOptions options;
  RunMode mode = RunMode::deterministic;
  Mapper* mapper = nullptr;  ///< not owned
  /// Called on the frontend's thread, if it has one.
  std::function<void(const TrackedFrame&)> on_tracked_frame = {};
};

class EstimatorLink final : public OdometryLink {
 public:
  static Result<std::unique_ptr<OdometryLink>> create(const EstimatorSetup& setup, const StereoRig& rig);
  ~EstimatorLink() override;

  Result<void> push(SensorEvent event) override;
  /// Waits for the estimates.
  Result<std::vector<KnownEstimate>> known_at(Time newest_image) override;
  Result<void> finish() override;

 private:
  struct Impl;
  explicit EstimatorLink(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace fbvins
