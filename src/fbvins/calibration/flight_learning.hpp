// SPDX-License-Identifier: Apache-2.0
// Private: what pieces of flights say of a calibration: which parameters they determine, which of these differ from what was
// given, and their values. One thread.
#pragma once

#include <vector>

#include "fbvins/calibration/flight_calibration.hpp"
#include "fbvins/calibration/flight_fit.hpp"

namespace fbvins {

struct FlightLesson {
  FlightRig rig;
  FlightNoise noise;
  std::vector<FlightFinding> findings;  ///< by parameter
  Eigen::VectorXd sigma;                ///< by parameter, with all of them unknown
  bool changed = false;                 ///< something that is flown
};

FlightLesson learn_from(const FlightPieces& pieces, const FlightRig& given);

/// Whether a file of a rig has it.
inline bool is_flown(FlightGroup group) { return group != FlightGroup::gyro_axes && group != FlightGroup::accel_axes; }

}  // namespace fbvins
