// SPDX-License-Identifier: Apache-2.0
// The odometry in lockstep with simulated time: what it says of an image becomes known a fixed time after the image, however fast
// the machine is. One thread asks; the odometry may have threads of its own, with the same result.
//
//   Result<std::unique_ptr<EstimatorLink>> link = EstimatorLink::create(setup, rig);
//   (*link)->push(reading);
//   Result<std::vector<Estimate>> known = (*link)->known_at(reading.t - delay);
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/pipeline/system.hpp"

namespace fbvins {

struct EstimatorSetup {
  SystemOptions options;
  RunMode mode = RunMode::deterministic;
  Mapper* mapper = nullptr;  ///< not owned
  /// On the frontend's thread, if it has one.
  std::function<void(const TrackedFrame&)> on_tracked_frame = {};
};

/// Of one image.
struct KnownEstimate {
  Odometry odometry;
  std::vector<MapUpdate> updates;  ///< of the map, since the image before
};

class EstimatorLink {
 public:
  static Result<std::unique_ptr<EstimatorLink>> create(const EstimatorSetup& setup, const StereoRig& rig);
  ~EstimatorLink();

  /// In order of time, but for images, which may come as late as their exposure makes them.
  Result<void> push(SensorEvent event);
  /// What was not told yet of images with stamps up to `newest_image`; waits for it.
  Result<std::vector<KnownEstimate>> known_at(Time newest_image);
  /// Works off what is waiting.
  Result<void> finish();

 private:
  struct Impl;
  explicit EstimatorLink(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace fbvins
