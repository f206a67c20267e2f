// SPDX-License-Identifier: Apache-2.0
// Runs a recording whose events are changed before the system gets them, and compares the result with the truth. Real
// recordings lie in FBVINS_DATA, and their tests are skipped where they are absent; the simulated one is always there.
//
//   Flown flown = fly(real_recording("MH_01_easy_17s"), config_for("klt"), [](double t_s, SensorEvent&) { return t_s < 8; });
//   flown.rmse_m(7)  // in the last second
#pragma once

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "fbvins/eval/alignment.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/pipeline/system.hpp"

namespace fbvins::test {

/// Changes an event that is `t_s` after the first image. Return false to drop the event.
using Alter = std::function<bool(double t_s, SensorEvent& event)>;

struct Flown {
  int images = 0;  ///< number of images in the recording
  Time start;
  std::vector<Odometry> odometry;
  std::map<FrameId, double> error_m;  ///< position error of each pose, after SE3 alignment of all poses
  Calibration calibration;

  double time_s(const Odometry& o) const { return (o.t - start).seconds(); }
  /// RMS of the position errors from `from_s` to `to_s` after the first image, whatever the health; infinite without poses.
  double rmse_m(double from_s = 0, double to_s = 1e9) const;
  double largest_error_of_good_m() const;
  int with_pose() const;
  int count(HealthState state, double from_s, double to_s) const;
  std::uint32_t resets() const { return odometry.empty() ? 0 : odometry.back().reset_counter; }
  /// A summary in one line, to be printed.
  std::string text() const;
};

inline std::filesystem::path real_recording(const std::string& name) {
  const char* data = std::getenv("FBVINS_DATA");
  return (data ? std::filesystem::path(data) : std::filesystem::path(FBVINS_SOURCE_DIR) / "../shared/data") / name;
}

/// Rendered by the CTest fixture simulated_flight (tests/simulated_flight.py): three seconds at rest, then motion.
inline std::filesystem::path simulated_recording() { return FBVINS_SIMULATED_FLIGHT; }

Flown fly(const std::filesystem::path& recording, const SystemOptions& config, const Alter& alter = nullptr,
          const std::function<void(StereoRig&)>& miscalibrate = nullptr);

SystemOptions config_for(const std::string& frontend);

}  // namespace fbvins::test
