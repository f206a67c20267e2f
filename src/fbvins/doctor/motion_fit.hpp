// SPDX-License-Identifier: Apache-2.0
// Precise comparison of camera and gyroscope: every feature is predicted from one image to the next with the gyroscope's rotation
// and the calibration. Finds the single change of the calibration that explains most of the error, then the next. Method:
// docs/doctor.md. Pure functions, any thread.
//
//   MotionFit fit = fit_motion(pairs, imu, {rig, offset_s});
//   for (const MotionChange& change : fit.changes) report(change);
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "fbvins/checkup/finding.hpp"
#include "fbvins/doctor/turn_fit.hpp"

namespace fbvins {

struct MotionStart {
  StereoRig rig;               ///< T_BC0 and left lens as far as known
  double offset_s = 0;         ///< t_imu = t_image + offset, as far as known
  bool focal_doubted = false;  ///< estimate it even where it explains little, and take the gyroscope's scale as right
  bool gyro_known = false;     ///< offset, line delay and rotation are (fit_gyro): what else is said of them is no change
};

struct MotionChange {
  FindingKind kind = FindingKind::time_offset;
  Eigen::VectorXd amount;  ///< added to the start: s, rad (R_CB Exp(amount)), logarithm of a factor, px
  Eigen::MatrixXd covariance;
  double explained_px = 0;
  int axis = -1;  ///< of the gyroscope, where it is the scale of one
};

struct MotionFit {
  bool usable = false;
  double error_px = 0, remaining_px = 0;  ///< typical error of a predicted feature at the start, and after the changes
  /// The start with the estimated corrections, also where they are not significant.
  Mat3 R_CB = Mat3::Identity();
  double offset_s = 0;
  Vec3 gyro_bias_radps = Vec3::Zero();
  /// Of offset and rotation, whether they are changes or not.
  double offset_sigma_s = 0;
  Vec3 rotation_sigma_rad = Vec3::Zero();
  Vec3 gyro_bias_sigma_radps = Vec3::Zero();
  /// Logarithm of the factor by which to multiply the focal length, where it was in doubt.
  std::optional<double> log_focal = {};
  double log_focal_sigma = 0;
  std::vector<MotionChange> changes;
};

MotionFit fit_motion(const std::vector<FramePair>& pairs, const ImuSeries& imu, const MotionStart& start);

/// Typical error of a predicted feature before the fit, px.
double prediction_error_px(const std::vector<FramePair>& pairs, const ImuSeries& imu, const MotionStart& start);

}  // namespace fbvins
