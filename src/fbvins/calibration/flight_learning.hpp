// SPDX-License-Identifier: Apache-2.0
// Private: what pieces of flights say of a calibration: which parameters they determine, which of these differ from what was
// given, and their values. One thread.
#pragma once

#include <vector>

#include "fbvins/calibration/flight_calibration.hpp"
#include "fbvins/calibration/flight_fit.hpp"

namespace fbvins {

/// The fit of all parameters at once.
struct FlightSurvey {
  FlightFit fit;
  FlightNoise noise;
};

struct FlightLesson {
  FlightRig rig;
  FlightNoise noise;
  std::vector<FlightFinding> findings;  ///< by parameter
  Eigen::MatrixXd covariance;           ///< of all parameters, with all of them unknown
  bool changed = false;                 ///< something
};

FlightSurvey survey_of(const FlightPieces& pieces, const FlightRig& given);
/// What is asked of a survey.
struct FlightQuestion {
  std::vector<FlightGroup> left = {};  ///< groups that stay as given, whatever the survey says of them
  /// Changes below this part of the prior's standard deviation do not matter: a flight's own errors (features that drift, a lens
  /// that no model describes) are as large, and a good calibration is better left alone.
  double matters = 0.2;
  /// What is not in `left` is known to be rough, and what is, is not: what the flights determine of the rough groups is judged
  /// with all others as given, and taken without asking whether chance explains it.
  bool rough = false;
};
FlightLesson learn_from(const FlightPieces& pieces, const FlightRig& given, const FlightSurvey& survey,
                        const FlightQuestion& question);

/// Scale and axes of the IMU: free in every fit, so that their errors are not taken for another parameter's.
inline bool is_axis(FlightGroup group) { return group == FlightGroup::gyro_axes || group == FlightGroup::accel_axes; }

}  // namespace fbvins
