// SPDX-License-Identifier: Apache-2.0
// What is believed before any measurement: of the first frame's state, and of the calibration where it is estimated.
// Pure functions.
#pragma once

#include "fbvins/estimator/estimator_options.hpp"
#include "fbvins/estimator/window_problem.hpp"

namespace fbvins {

/// Of the first frame: position and heading are a choice of W, biases are near zero, tilt and velocity are wide open: the
/// tilt of W where that is estimated, else that of the frame. The initial solution is where the optimiser starts, not a belief:
/// it was made from measurements that the window still holds.
WindowPrior first_frame_prior(const InitialiserOptions& options, const NavState& state, bool estimate_tilt);

/// Puts the belief about the calibration before the first frame's: `calibrated` is right within the options' standard
/// deviations. The two cameras are held to one another far more firmly than to the IMU: scale hangs on their distance.
WindowPrior with_calibration_belief(WindowPrior prior, const CalibrationBelief& belief, const Calibration& calibrated);

}  // namespace fbvins
