// SPDX-License-Identifier: Apache-2.0
// A finished flight as the events that a live one would have published: from a folder of `fbvins run --out`, or from a flight
// record.
//
//   Result<std::unique_ptr<FinishedFlight>> flight = open_finished_flight("out/klt", "MH_01_easy");
//   for (std::size_t i = 0; i < (*flight)->size(); ++i) sink.take((*flight)->event(i));
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/live/live_event.hpp"
#include "fbvins/web/flight_history.hpp"

namespace fbvins {

/// Events in order of time: Odometry and, where there are any, StereoFrame (left alone), LiveView, LiveStatus, LiveMark. One
/// thread.
class FinishedFlight {
 public:
  virtual ~FinishedFlight() = default;
  virtual std::size_t size() const = 0;
  virtual Time time_of(std::size_t i) const = 0;
  virtual bool is_image(std::size_t i) const = 0;
  /// Images are read from the disk at this call.
  virtual LiveEvent event(std::size_t i) const = 0;

  std::string name, frontend;
  std::vector<PathPoint> path;  ///< the whole path; times since the first event
};

/// `recording`: the recording with a run's images; empty: without images.
Result<std::unique_ptr<FinishedFlight>> open_finished_flight(const std::string& path, const std::string& recording = "");

}  // namespace fbvins
