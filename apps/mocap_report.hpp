// SPDX-License-Identifier: Apache-2.0
// Motion capture for commands: reads files and inspects them for faults, and prints the calibration found.
#pragma once

#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/mocap/axis_errors.hpp"
#include "fbvins/mocap/hand_eye.hpp"

namespace fbvins::app {

struct Markers {
  std::string format, body;
  std::size_t poses = 0;
  int unseen = 0;
  Time start;
  MarkerInspection inspection;
  MarkerTrack clean;
};

Result<Markers> read_markers(const std::string& path, const std::string& body);
/// A trajectory file, or trajectory.csv in the folder of a run.
Result<Trajectory<W>> read_estimate(const std::string& path);
/// The part of the truth within the estimate's time.
Trajectory<W> within(const Trajectory<W>& truth, const Trajectory<W>& estimate);

std::string describe(const Markers& markers);
/// Times of faults are relative to `start`, by the motion capture's clock.
std::string describe(const HandEye& found, Time start);
std::string to_table(const AxisErrors& errors, Time start);

}  // namespace fbvins::app
