// SPDX-License-Identifier: Apache-2.0
// Priors before any measurement: of the first frame's state, and of the calibration if it is estimated.
// Pure functions.
#pragma once

#include "fbvins/estimator/window_problem.hpp"
#include "fbvins/types/imu_state.hpp"

namespace fbvins {

/// Prior standard deviations of the calibration, if it is estimated.
struct CalibrationPrior {
  double rotation_sigma_rad = 0.02;         ///< of the cameras to the IMU
  double position_sigma_m = 0.01;           ///< of the cameras in the IMU's frame
  double stereo_rotation_sigma_rad = 2e-4;  ///< between the cameras
  double stereo_position_sigma_m = 1e-4;    ///< of the right camera in the left one's frame
  double time_offset_sigma_s = 0.005;
  double line_delay_sigma_s = 20e-6;
};

/// Biases of an unknown IMU: zero, with a wide covariance.
ImuBiasEstimate unknown_biases();

/// Prior of the first frame: position and heading are fixed as the gauge, biases as given, velocity and the
/// tilt of G almost free. The initial solution is the optimiser's starting point, not
/// the prior's mean: it was made from measurements that are in the window.
WindowPrior first_frame_prior(const NavState<G>& state, const ImuBiasEstimate& biases);

/// Inserts the prior of the calibration before that of the first frame: its mean is `calibrated`, its standard deviations are
/// those given. The pose between the cameras is constrained far more tightly than that to the IMU: it determines the scale.
WindowPrior with_calibration_prior(WindowPrior prior, const CalibrationPrior& sigmas, const Calibration& calibrated);

}  // namespace fbvins
