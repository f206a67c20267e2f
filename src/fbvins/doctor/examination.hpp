// SPDX-License-Identifier: Apache-2.0
// Private to the doctor: one examination, step by step. What a step finds wrong is corrected for the steps after it.
//   examination.cpp          order, readings by themselves, images by themselves
//   examination_imu.cpp      the gyroscope against what the images show
//   examination_gyro.cpp     time offset, line delay and mounting of one camera, by the solver that flies; offsets that drift
//   examination_accel.cpp    the accelerometer against what the images show
//   examination_force.cpp    the same by the tracks of one camera, without depths
//   examination_cameras.cpp  lenses and the pair of cameras
//   examination_focal.cpp    the focal length that both lenses have in common
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fbvins/core/angle.hpp"
#include "fbvins/doctor/change_search.hpp"
#include "fbvins/doctor/doctor.hpp"
#include "fbvins/doctor/motion_fit.hpp"
#include "fbvins/doctor/stereo_fit.hpp"

namespace fbvins {

namespace doctor {
/// A ratio this near to that of two units that are often confused is taken for it.
inline constexpr double kUnitTolerance = 0.15;
/// Standard deviations from which a difference of practical size is a finding.
inline constexpr double kSignificant = 5;
/// Smaller errors of time offset and mounting are not spoken of.
inline constexpr double kTimePractical_s = 3e-3, kRotationPractical_rad = 0.0175;
/// Least rotation about the second principal axis from which axes can be identified, rad in a tenth of a second.
inline constexpr double kLeastSecondAxis_rad = 2.5e-3;
inline bool certainly(double wrong, double sigma, double practical) {
  return std::abs(wrong) > practical && std::abs(wrong) > kSignificant * sigma;
}
inline double angle_of(const Mat3& R) { return so3_log(Quat(R)).norm(); }
}  // namespace doctor

class Examination {
 public:
  Examination(Evidence evidence, CalibrationStyle style)
      : evidence_(std::move(evidence)), style_(style), imu_(evidence_.imu), rig_(evidence_.rig) {}

  Diagnosis run();

 private:
  Finding& found(FindingKind kind, double size, double sigma, std::string unit) {
    Finding finding;
    finding.kind = kind, finding.size = size, finding.sigma = sigma, finding.unit = std::move(unit);
    out_.findings.push_back(std::move(finding));
    return out_.findings.back();
  }
  // Not inline: GCC 12 then gives a false warning (-Wstringop-overflow).
  void not_judged(std::string_view what);
  void measured(std::string sentence) { out_.measured.push_back(std::move(sentence)); }
  void keep(std::optional<Finding> finding) {
    if (finding) out_.findings.push_back(std::move(*finding));
  }
  bool has_depths() const { return rig_.has_right() || rig_.depth; }
  bool has(FindingKind kind) const {
    return std::any_of(out_.findings.begin(), out_.findings.end(), [&](const Finding& f) { return f.kind == kind; });
  }

  void impossible_readings();
  void readings();
  void images();
  bool fixed_in_view(double share_of_features);
  void blur();
  void right_images_late();
  void turns();
  void gyro_unit(const TurnFit& fit);
  void turn_cameras(const Mat3& R_CB);
  void gyro_axes(const TurnFit& fit);
  bool accelerometer_turned_too(const Mat3& axes, const Mat3& R_CB, const TurnFit& fit) const;
  void motion();
  void motion_change(const MotionChange& change);
  void gyro_bias(const MotionFit& fit);
  bool drift(const MotionFit& fit);
  void time_offset(const MotionFit& fit);
  void rotation(const MotionFit& fit);
  void lens(FindingKind kind, WhichLens which, const Eigen::VectorXd& amount, const Eigen::VectorXd& sigma, double explained_px);
  MotionFit fit_with_gyro() const;
  MotionFit with_common_focal(MotionFit fit);
  void use_common_focal(double log_focal, double sigma, double explained_px, const StereoFit& pair);
  StereoFit pair_fit(StereoRig rig, bool focal_known);
  void stereo();
  void stereo_change(const StereoChange& change);
  AccelFit in_step(AccelFit as_stamped);
  void accelerations();
  void accel_axes(const AccelFit& fit);
  bool turned_with_imu(const AccelFit& fit);
  bool position(const AccelFit& fit);
  void accel_bias(const AccelFit& fit);
  void accel_scale(const AccelFit& fit);
  struct AxesTried {
    Mat3 axes;
    double error_px = 0;
  };
  AxesTried tracks_with(const Mat3& axes, bool and_bias) const;
  bool force_axes();
  void force();
  void force_change(const ChangeGroup& group, const Amount& amount);
  void baseline_length(double factor, double sigma);
  Diagnosis done();

  Evidence evidence_;
  CalibrationStyle style_;
  ImuSeries imu_;  // in rad/s and the body's axes, by the findings so far
  StereoRig rig_;  // the calibration, corrected by the findings so far
  std::vector<FramePair> pairs_;
  /// Result of the stereo fit, with which that of the motion fit is combined.
  struct PairShown {
    StereoRig before;  // the rig before it
    std::size_t first_finding = 0;
    std::vector<StereoChange> changes;
    bool judged = false;
  };
  PairShown pair_;
  double accel_unit_ = 1;     // m/s^2 for a reading of 1
  bool may_be_bias_ = false;  // a mean reading that is not gravity's
  double offset_s_ = 0;
  Vec3 gyro_bias_ = Vec3::Zero();
  bool gyro_stuck_ = false, accel_stuck_ = false;
  bool turns_seen_ = false, turns_agree_ = false, motion_agrees_ = false;
  Diagnosis out_;
};

}  // namespace fbvins
