// SPDX-License-Identifier: Apache-2.0
// Summary of a live flight: data received and dropped, latency, health; accuracy where there is ground truth.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "fbvins/eval/evaluation.hpp"
#include "fbvins/live/live_event.hpp"
#include "fbvins/live/sink.hpp"
#include "fbvins/live/source.hpp"
#include "fbvins/types/imu_state.hpp"

namespace fbvins::app {

/// Counts events; must outlive its sink.
struct LiveTotals {
  std::map<std::string, std::int64_t> health;  ///< images per "state" or "state/reason"
  std::int64_t with_pose = 0;                  ///< images
  std::int64_t live_poses = 0;                 ///< at IMU rate
  LiveStatus last;
  std::optional<ImuState> imu_state;  ///< as of the newest image in good health

  std::unique_ptr<Sink> make_sink(double rig_time_offset_s);
};

struct LiveSummary {
  LiveTotals totals;
  std::string source, frontend;
  std::optional<Evaluation> at_images, at_imu_rate;  ///< against the recording's truth
  double peak_memory_mb = 0;
};

/// `folder` holds the finished trajectories; empty: no accuracy.
LiveSummary summarise(const LiveTotals& totals, const std::string& source_name, const std::string& frontend, const Source& source,
                      const std::string& folder);
std::string to_json_text(const LiveSummary& summary);
std::string to_text(const LiveSummary& summary);

}  // namespace fbvins::app
