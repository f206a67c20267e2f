// SPDX-License-Identifier: Apache-2.0
// The signals of the control loops from a flight's log, evenly sampled, with the gains as flown: from `fbvins fly` (a folder
// with flight.csv and control.yaml) or from PX4 (.ulg). Pure functions.
#pragma once

#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/flight/control_options.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {

struct LoopLog {
  std::string source;
  double rate_hz = 200;
  ControlOptions control;
  // One entry per sample. Rates and torques in V (FLU), the others in a gravity-aligned frame with z up.
  std::vector<Vec3> rate;                ///< rad/s, filtered by the controller
  std::vector<Vec3> torque;              ///< shares of the largest torque
  std::vector<Vec3> velocity;            ///< m/s
  std::vector<Vec3> acceleration_asked;  ///< m/s^2
};

/// Source of the velocity: the controller's estimate, or the truth (in a real flight, motion capture).
enum class VelocitySource { estimate, truth };

/// `path`: a folder of `fbvins fly`, its flight.csv, or a .ulg. Keeps only the part in flight; an error if it is under 10 s.
Result<LoopLog> read_loop_log(const std::string& path, VelocitySource velocity = VelocitySource::estimate);

}  // namespace fbvins
