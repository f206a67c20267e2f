// SPDX-License-Identifier: Apache-2.0
// Private to calibration: fit, judgement of noise and outliers, fit: the parts of a camera-IMU calibration that repeat. A value;
// one owner.
//
//   ImuCameraFit fit(start);
//   if (!fit.solve() || !fit.judge()) ...   // undetermined
#pragma once

#include <optional>

#include "fbvins/calibration/imu_camera_collect.hpp"

namespace fbvins {

class ImuCameraFit {
 public:
  explicit ImuCameraFit(CalibrationStart start);

  /// False where no step can be computed, or the steps do not come to an end.
  bool solve();
  /// Corners, images and readings are judged by their residuals, and the noise by those that are left. False where the
  /// calibration is not determined.
  bool judge();
  void change(const CalibrationSetup& setup) { problem_.change(setup); }
  /// The path again with knots half as far apart; the calibration stays.
  void halve_spacing();

  double image_factor() const { return image_factor_; }
  double gyro_rms() const { return gyro_rms_; }  ///< over the noise given
  double accel_rms() const { return accel_rms_; }
  double worst_rms() const;
  int iterations() const { return iterations_; }
  ImuCameraProblem& problem() { return problem_; }
  const ImuCameraProblem& problem() const { return problem_; }
  const CalibrationStart& start() const { return start_; }
  /// Of the calibration's unknowns, as judge() left it.
  const Eigen::MatrixXd& covariance() const { return *covariance_; }

 private:
  void judge_corners();
  void judge_readings();

  CalibrationStart start_;
  ImuCameraProblem problem_;
  std::optional<Eigen::MatrixXd> covariance_;
  double gyro_rms_ = 0, accel_rms_ = 0, image_factor_ = 1;
  int iterations_ = 0;
};

/// What all corners of an image are off by together, over their noise, that is more than chance.
inline constexpr double kImagesTogether = 1.08;

}  // namespace fbvins
