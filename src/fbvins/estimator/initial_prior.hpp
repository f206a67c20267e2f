// SPDX-License-Identifier: Apache-2.0
// Priors before any measurement: of the first frame's state, and of the calibration where it is estimated.
// Pure functions.
#pragma once

#include "fbvins/estimator/window_problem.hpp"
#include "fbvins/types/imu_state.hpp"

namespace fbvins {

/// How far the calibration may be off, where it is estimated: standard deviations.
struct CalibrationPrior {
  double rotation_sigma_rad = 0.02;         ///< of the cameras to the IMU
  double position_sigma_m = 0.01;           ///< of the cameras in the IMU's frame
  double stereo_rotation_sigma_rad = 2e-4;  ///< between the cameras
  double stereo_position_sigma_m = 1e-4;    ///< of the right camera in the left one's frame
  double time_offset_sigma_s = 0.005;
};

/// Biases of an IMU of which nothing is known: near zero.
ImuBiasEstimate unknown_biases();

/// Of the first frame: position and heading are a choice of W, biases as given, tilt and velocity are wide open: the
/// tilt of W where that is estimated, else that of the frame. The initial solution is where the optimiser starts, not a prior:
/// it was made from measurements that the window still holds.
WindowPrior first_frame_prior(const NavState& state, const ImuBiasEstimate& biases, bool estimate_tilt);

/// Puts the prior of the calibration before that of the first frame: its mean is `calibrated`, its standard deviations are those
/// given. The two cameras are held to one another far more firmly than to the IMU: scale hangs on their distance.
WindowPrior with_calibration_prior(WindowPrior prior, const CalibrationPrior& sigmas, const Calibration& calibrated);

}  // namespace fbvins
