// SPDX-License-Identifier: Apache-2.0
// A source by its name, as `fbvins live --source` has it.
//
//   Result<std::unique_ptr<Source>> source = make_source("replay:MH_01_easy");
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "fbvins/io/dataset.hpp"
#include "fbvins/live/source.hpp"

namespace fbvins {

/// Options of a source beside its name; each source uses those that apply to it.
struct SourceOptions {
  DatasetOptions dataset;  ///< of a replay; its Kalibr files are the calibration of any source
  int laps = 1;            ///< how often a replay is played
  bool preload = false;    ///< a replay is decoded before its clock starts
  /// Gets one sentence for each event at the device, on the source's thread.
  std::function<void(const std::string&)> say = [](const std::string&) {};
  /// Asked repeatedly while make_source() waits for a device: true ends that with an error.
  std::function<bool()> give_up = [] { return false; };
  /// Of sources that know none and are given no file: to calibrate, which needs the images' sizes alone.
  std::optional<StereoRig> uncalibrated = {};
  std::string socket_group = "";  ///< that may connect to a socket; empty: this program's user alone
};

/// KIND:WHERE. replay:DATASET[@SPEED] plays a recording in wall time; socket:PATH listens there for another process
/// (docs/socket.md), and waits for the first one where there is no calibration.
Result<std::unique_ptr<Source>> make_source(const std::string& name, const SourceOptions& options = {});

}  // namespace fbvins
