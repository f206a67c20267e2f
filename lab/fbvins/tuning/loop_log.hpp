// SPDX-License-Identifier: Apache-2.0
// What a flight's log tells of its control loops, evenly sampled, with the gains that were flown: of `fbvins fly` (a folder with
// flight.csv and control.yaml) or of PX4 (.ulg). Pure functions.
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
  // A sample each. Rates and torques about V's axes (forward, left, up), the others in a level frame with z up.
  std::vector<Vec3> rate;                ///< rad/s, as the controller sees it
  std::vector<Vec3> torque;              ///< shares
  std::vector<Vec3> velocity;            ///< m/s
  std::vector<Vec3> acceleration_asked;  ///< m/s^2
};

/// Where velocity is taken from: what the controller flew by, or the truth (motion capture).
enum class VelocitySource { estimate, truth };

/// A folder of `fbvins fly`, its flight.csv, or a .ulg. Only the part in flight.
Result<LoopLog> read_loop_log(const std::string& path, VelocitySource velocity = VelocitySource::estimate);

}  // namespace fbvins
