// SPDX-License-Identifier: Apache-2.0
// Between simulated sensors and whoever flies by what the odometry makes of them: in lockstep with simulated time
// (estimator_link.hpp), or in wall time (live_link.hpp). One thread asks.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/live/live_event.hpp"
#include "fbvins/types/loop.hpp"
#include "fbvins/types/odometry.hpp"
#include "fbvins/types/sensor_event.hpp"

namespace fbvins {

/// Of one image.
struct KnownEstimate {
  Odometry odometry;
  std::vector<MapUpdate> updates;  ///< of the map, since the image before
};

/// How a flight in wall time went.
struct WallTime {
  double rate = 1;        ///< seconds of the flight in one of this machine's, as wanted
  double behind_s = 0;    ///< the flight fell behind this machine's clock by so much, at most
  LatencySummary answer;  ///< from an image sent to its estimate in the controller's hands
  LiveStatus live;        ///< at the end
};

class OdometryLink {
 public:
  OdometryLink() = default;
  OdometryLink(const OdometryLink&) = delete;
  OdometryLink& operator=(const OdometryLink&) = delete;
  virtual ~OdometryLink() = default;

  /// In order of time, but for images, which may come as late as their exposure makes them.
  virtual Result<void> push(SensorEvent event) = 0;
  /// What was not told yet of images with stamps up to `newest_image`.
  virtual Result<std::vector<KnownEstimate>> known_at(Time newest_image) = 0;
  /// Works off what is waiting.
  virtual Result<void> finish() = 0;
  /// Of wall time alone.
  virtual std::optional<WallTime> wall_time() const { return std::nullopt; }
};

}  // namespace fbvins
