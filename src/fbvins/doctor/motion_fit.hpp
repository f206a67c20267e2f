// SPDX-License-Identifier: Apache-2.0
// Camera against gyroscope to the last digit: every feature's path from image to image against the turn that the readings tell
// through the calibration, and the one change of the calibration, then the next, that explains what is left. Method:
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
  bool focal_doubted = false;  ///< it is estimated even where it explains little, and the gyroscope's scale is right
};

struct MotionChange {
  FindingKind kind = FindingKind::time_offset;
  Eigen::VectorXd amount;  ///< what was added to the start: s, rad (R_CB Exp(amount)), logarithm of a factor, px
  Eigen::MatrixXd covariance;
  double explained_px = 0;
};

struct MotionFit {
  bool usable = false;
  double error_px = 0, remaining_px = 0;  ///< typical error of a feature's path at the start, and after the changes
  /// Of the start, with the changes; those that were not found significant are small.
  Mat3 R_CB = Mat3::Identity();
  double offset_s = 0;
  Vec3 gyro_bias_radps = Vec3::Zero();
  /// Offset and rotation, whether they were changes or not.
  double offset_sigma_s = 0;
  Vec3 rotation_sigma_rad = Vec3::Zero();
  /// Logarithm of what the focal length is to be multiplied by, where it was doubted.
  std::optional<double> log_focal = {};
  double log_focal_sigma = 0;
  std::vector<MotionChange> changes;
};

MotionFit fit_motion(const std::vector<FramePair>& pairs, const ImuSeries& imu, const MotionStart& start);

}  // namespace fbvins
