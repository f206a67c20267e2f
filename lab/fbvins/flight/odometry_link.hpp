// SPDX-License-Identifier: Apache-2.0
// Interface from simulated sensors to a controller through the odometry: in lockstep with simulated time
// (estimator_link.hpp) or in wall time (live_link.hpp). One owner.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/live/live_event.hpp"
#include "fbvins/types/loop.hpp"
#include "fbvins/types/odometry.hpp"
#include "fbvins/types/sensor_event.hpp"

namespace fbvins {

/// The estimate of one image.
struct KnownEstimate {
  Odometry odometry;
  std::vector<MapUpdate> updates;  ///< since the previous image
};

/// Timing of a flight in wall time.
struct WallTime {
  double rate = 1;        ///< wanted simulated seconds per second of wall time
  double behind_s = 0;    ///< largest delay of the flight behind the machine's clock
  LatencySummary answer;  ///< from sending an image to its estimate at the controller
  LiveStatus live;        ///< at the end
};

class OdometryLink {
 public:
  OdometryLink() = default;
  OdometryLink(const OdometryLink&) = delete;
  OdometryLink& operator=(const OdometryLink&) = delete;
  virtual ~OdometryLink() = default;

  /// In order of time, except that an image comes after its exposure.
  virtual Result<void> push(SensorEvent event) = 0;
  /// New estimates of images with stamps up to `newest_image`.
  virtual Result<std::vector<KnownEstimate>> known_at(Time newest_image) = 0;
  /// Processes what is queued; no pushes afterwards.
  virtual Result<void> finish() = 0;
  /// In wall time only.
  virtual std::optional<WallTime> wall_time() const { return std::nullopt; }
};

}  // namespace fbvins
