// SPDX-License-Identifier: Apache-2.0
// The gyroscope compared with the rotation that the images show.
#include "fbvins/doctor/examination.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "fbvins/checkup/noise_figures.hpp"
#include "fbvins/checkup/reading_noise_seen.hpp"
#include "fbvins/core/angle.hpp"
#include "fbvins/doctor/axes.hpp"
#include "fbvins/doctor/imu_health.hpp"
#include "fbvins/imu/nav_state.hpp"
#include "fbvins/imu/propagation.hpp"

namespace fbvins {
namespace {

using doctor::angle_of, doctor::certainly, doctor::kLeastSecondAxis_rad, doctor::kRotationPractical_rad, doctor::kSignificant,
    doctor::kTimePractical_s;
using doctor::kUnitTolerance;

/// Below this correlation the readings do not agree with the images for any axes, unit and time offset.
constexpr double kAgreement = 0.7;
/// A smaller factor is a wrong range or a wrong lens, not a wrong unit.
constexpr double kMostScale = 1.7;
/// Share of saturated readings beyond which the rest says little about scale and axes.
constexpr double kMostCutOff = 0.2;
constexpr double kGyroBiasPractical_radps = 0.1;

/// A change of one camera's lens must leave less than this share of the error.
constexpr double kLensLeaves = 0.9;

/// Mean specific force over a quarter of a second around t.
Vec3 mean_force(const ImuSeries& imu, Time t) {
  constexpr int kSteps = 25;
  Vec3 sum = Vec3::Zero();
  for (int i = -kSteps / 2; i <= kSteps / 2; ++i) sum += imu.at(t + Duration{i * 10'000'000}).accel_mps2;
  return sum / kSteps;
}

/// By how much the direction of the mean specific force turns otherwise than the gyroscope says, in half a second, in the mean of
/// squares: most of it is gravity.
double gravity_turns_off(const ImuSeries& imu) {
  const Duration apart{500'000'000};
  double sum = 0, count = 0;
  for (Time t = imu.samples().front().t; imu.covers(t, t + apart); t = t + apart, ++count) {
    const Quat turn = integrate_gyro(imu.segment(t, t + apart), Vec3::Zero());
    sum += (mean_force(imu, t).normalized() - turn * mean_force(imu, t + apart).normalized()).squaredNorm();
  }
  return sum / std::max(count, 1.0);
}

}  // namespace

void Examination::turns() {
  offset_s_ = rig_.time_offset_s;
  const std::vector<ImuSample>& readings = evidence_.imu;
  const std::vector<Time>& stamps = evidence_.stamps;
  if (readings.empty() || stamps.empty() || readings.front().t > stamps.back() || readings.back().t < stamps.front()) {
    not_judged("gyroscope, axes, rotation and time between camera and IMU: there are no readings at the time of the images");
    return;
  }
  if (cut_off_share_of_gyro(evidence_.imu) > kMostCutOff) {
    turns_seen_ = true;
    not_judged("gyroscope, axes, rotation and time between camera and IMU: the gyroscope's readings are saturated too often");
    return;
  }
  if (gyro_stuck_) {
    turns_seen_ = true;
    not_judged("gyroscope, axes, rotation and time between camera and IMU: an axis of the gyroscope is stuck");
    return;
  }
  const TurnFit fit = fit_turns(pairs_, imu_, rig_);
  measured(fmt::format(
      "rotation seen: {:.4f} rad in a tenth of a second ({} pairs; by axis {:.4f} {:.4f} {:.4f}); correlation with the gyroscope {:.4f} at {:.1f} ms, scale {:.4f}",
      fit.turning_rad, pairs_.size(), fit.spread.x(), fit.spread.y(), fit.spread.z(), fit.correlation, 1e3 * fit.offset_s,
      fit.scale));
  turns_seen_ = fit.seen;
  if (!fit.seen) {
    not_judged(
        "gyroscope, axes, rotation and time between camera and IMU: the rig hardly turned, or its images show too few features");
    return;
  }
  const bool hidden = has(FindingKind::fixed_in_view) || has(FindingKind::projector_dots);
  if (fit.correlation < kAgreement || (hidden && std::abs(fit.scale - 1) > kUnitTolerance)) {
    if (hidden) {
      not_judged("gyroscope, axes, rotation and time between camera and IMU: features that are fixed in view hide the rotation");
      return;
    }
    if (fit.spread.y() < kLeastSecondAxis_rad) {
      not_judged("gyroscope, axes, rotation and time between camera and IMU: the rig turned too little");
      return;
    }
    Finding& finding = found(FindingKind::imu_camera_disagree, fit.correlation, 0, "correlation");
    finding.measured = fmt::format(
        "the rotation that the images show and the gyroscope's correlate by {:.2f} at best, for any axes, unit and time offset (up to 5 s)",
        fit.correlation);
    finding.expected = "above 0.9";
    finding.advice = "the clocks are farther apart, or drift, or this is not the IMU of these cameras";
    return;
  }
  turns_agree_ = true;
  offset_s_ = fit.offset_s;
  gyro_unit(fit);
  if (fit.spread.y() < kLeastSecondAxis_rad) {
    not_judged("axes of the IMU and its rotation against the camera: the rig turned about one axis only");
    turns_agree_ = false;
    return;
  }
  gyro_axes(fit);
}

void Examination::gyro_unit(const TurnFit& fit) {
  if (fit.scale < kMostScale && fit.scale > 1 / kMostScale) return;  // the motion fit tells whether it is the scale or the lens
  double factor = fit.scale;
  std::string advice = fmt::format("multiply the gyroscope's readings by {:.4g}", factor);
  for (const auto& [unit, name] :
       {std::pair{1 / kDegreesPerRad, "they look like degrees: multiply the gyroscope's readings by pi / 180"},
        std::pair{kDegreesPerRad,
                  "they were in rad/s already and were converted from degrees: multiply the gyroscope's readings by 180 / pi"}})
    if (std::abs(factor / unit - 1) < 2 * kUnitTolerance) factor = unit, advice = name;
  Finding& finding = found(FindingKind::gyro_units, 1 / fit.scale, (1 - fit.correlation) / fit.scale, "times too large");
  finding.measured = fmt::format("the gyroscope's readings are {:.4g} +- {:.2g} times the rotation that the images show",
                                 finding.size, finding.sigma);
  finding.expected = "1, in rad/s";
  finding.advice = advice;
  imu_ = imu_.with_gyro(factor * Mat3::Identity());
  // The readings' noise was measured in the wrong unit.
  if (std::erase_if(out_.findings, [](const Finding& f) { return f.kind == FindingKind::imu_noise && f.unit == kOfReadings; }) >
      0)
    rig_.imu_noise = plausible(evidence_.rig.imu_noise);
}

/// Whether the accelerometer fits better with the whole IMU rotated than with the gyroscope's axes mixed up.
bool Examination::accelerometer_turned_too(const Mat3& axes, const Mat3& R_CB, const TurnFit& fit) const {
  if (!has_depths()) return gravity_turns_off(imu_) <= gravity_turns_off(imu_.with_gyro(axes));
  StereoRig turned = rig_;
  turned.cameras[0].T_BC = {Mat3(R_CB.transpose()), rig_.T_BC0().p};
  const AccelFit as_mounted = fit_accelerations(pairs_, imu_, turned, {fit.offset_s, Vec3::Zero()});
  const AccelFit as_named = fit_accelerations(pairs_, imu_.with_gyro(axes), rig_, {fit.offset_s, Vec3::Zero()});
  return as_mounted.unexplained_as_named <= as_named.unexplained_as_named;
}

/// The left one where it is, the right one with it.
void Examination::turn_cameras(const Mat3& R_CB) {
  const StereoRig before = rig_;
  rig_.cameras[0].T_BC = {Mat3(R_CB.transpose()), before.T_BC0().p};
  for (int i = 1; i < rig_.camera_count(); ++i)
    rig_.cameras[static_cast<std::size_t>(i)].T_BC = rig_.T_BC0() * (before.T_BC0().inverse() * before.T_BC(i));
}

void Examination::gyro_axes(const TurnFit& fit) {
  const Mat3 R_CB_calibrated = rig_.T_BC0().R().transpose();
  const Mat3 N = R_CB_calibrated.transpose() * fit.R_CB;  // of readings, in the body's axes as calibrated
  const Mat3 P = nearest_axes(N);
  const double rest = angle_of(N * P.transpose());
  const bool right_way = P == Mat3::Identity();
  if (right_way && !fit.mirrored) {
    // A smaller rotation is left to the motion fit, which is more precise and starts at the calibration.
    if (rest > 0.35) rig_.cameras[0].T_BC = {Mat3(fit.R_CB.transpose()), rig_.T_BC0().p};
    return;
  }
  const bool mounted = !fit.mirrored && (rest > 0.17 || accelerometer_turned_too(P, fit.R_CB, fit));
  if (mounted) {
    turn_cameras(fit.R_CB);
    return;  // the motion fit tells by how much
  }
  Finding& finding =
      found(FindingKind::gyro_axes, kDegreesPerRad * rest, kDegreesPerRad * (1 - fit.correlation), "deg from these axes");
  finding.measured =
      fmt::format("the gyroscope fits the images with its axes named ({}) (correlation {:.3f})", axes_text(P), fit.correlation);
  finding.expected = "(x, y, z), and the accelerometer's axes are the body's";
  finding.advice = fmt::format("pass ({}) as (x, y, z) of the angular rate", axes_text(P));
  imu_ = imu_.with_gyro(P);
}

void Examination::motion() {
  // From the rotations where that predicts features better than what was given: a rig that hardly turns tells little of time.
  if (prediction_error_px(pairs_, imu_, {rig_, rig_.time_offset_s}) <= prediction_error_px(pairs_, imu_, {rig_, offset_s_}))
    offset_s_ = rig_.time_offset_s;
  const MotionFit fit = with_common_focal(fit_with_gyro());
  if (!fit.usable) {
    not_judged("rotation and time between camera and IMU: too few images with readings around them");
    return;
  }
  motion_agrees_ = true;
  measured(fmt::format(
      "time offset {:.2f} +- {:.2f} ms; rotation from the calibration's {:.2f} deg (+- {:.2f}); error of a predicted feature {:.2f} px, after the changes {:.2f}",
      1e3 * fit.offset_s, 1e3 * fit.offset_sigma_s, kDegreesPerRad * angle_of(evidence_.rig.T_BC0().R() * fit.R_CB),
      kDegreesPerRad * fit.rotation_sigma_rad.maxCoeff(), fit.error_px, fit.remaining_px));
  for (const MotionChange& change : fit.changes)
    measured(fmt::format("  motion: {} {} +- {} explains {:.2f} px", to_string(change.kind), change.amount.norm(),
                         change.covariance.diagonal().cwiseSqrt().norm(), change.explained_px));
  if (!drift(fit)) time_offset(fit);
  rotation(fit);
  offset_s_ = fit.offset_s;
  gyro_bias_ = fit.gyro_bias_radps;
  gyro_bias(fit);
  out_.predicted_px = prediction_error_px(pairs_, imu_, {evidence_.rig, evidence_.rig.time_offset_s});
  // Without depths, what a shutter and a motion that changes within it leave of the error looks like a lens.
  const bool lens_judged = has_depths() || fit.remaining_px < kLensLeaves * fit.error_px;
  for (const MotionChange& change : fit.changes) {
    const bool lens = change.kind == FindingKind::focal_length || change.kind == FindingKind::principal_point ||
                      change.kind == FindingKind::distortion;
    if (lens && (!lens_judged || (change.kind == FindingKind::focal_length && fit.log_focal))) continue;
    motion_change(change);
  }
}

void Examination::motion_change(const MotionChange& change) {
  const Eigen::VectorXd sigma = change.covariance.diagonal().cwiseSqrt();
  if (change.kind == FindingKind::gyro_scale) {
    const std::string axis = change.axis < 0 ? "" : fmt::format(" about {}", "xyz"[change.axis]);
    Finding& finding = found(change.kind, 100 * (std::exp(-change.amount(0)) - 1), 100 * sigma(0), "%");
    finding.measured =
        fmt::format("the gyroscope's readings{} are {:.1f} +- {:.1f} % too large", axis, finding.size, finding.sigma);
    finding.expected = "within 1 % of the rotation that the images show";
    finding.advice =
        fmt::format("multiply the gyroscope's readings{} by {:.4f}, or look up its range", axis, std::exp(change.amount(0)));
    Vec3 factor = Vec3::Ones();
    for (int i = 0; i < 3; ++i)
      if (change.axis < 0 || change.axis == i) factor(i) = std::exp(change.amount(0));
    imu_ = imu_.with_gyro(factor.asDiagonal());
    gyro_bias_ = factor.cwiseProduct(gyro_bias_);
  } else if (change.kind == FindingKind::gyro_by_force) {
    const double largest = change.amount.cwiseAbs().maxCoeff();
    Finding& finding = found(change.kind, largest, sigma.maxCoeff(), "rad/s for each m/s^2");
    finding.measured = fmt::format(
        "the gyroscope reads up to {:.4f} +- {:.4f} rad/s of each m/s^2 of specific force, which changes its bias by {:.2f} rad/s where the IMU is turned over",
        largest, finding.sigma, 2 * kGravity_mps2 * largest);
    finding.expected = "less than 0.002, or a calibration that has it";
    finding.advice =
        "calibrate scale and axes of the IMU (fbvins calibrate --imu-axes), or give the matrices of its calibration (Kalibr's A, OpenVINS' Tg)";
  } else if (change.kind == FindingKind::rolling_shutter) {
    Finding& finding = found(change.kind, 1e3 * change.amount(0), 1e3 * sigma(0), "ms");
    const double calibrated_ms = 1e3 * rig_.times(0).line_delay_s * rig_.left().height();
    finding.measured = fmt::format("an image's last line is exposed {:.1f} +- {:.1f} ms after its first",
                                   calibrated_ms + finding.size, finding.sigma);
    finding.expected = calibrated_ms == 0 ? "0, as the calibration has no line delay"
                                          : fmt::format("{:.1f} ms by the calibration", calibrated_ms);
    finding.advice = "put the line delay into the calibration";
    rig_.line_delay_s += change.amount(0) / rig_.left().height();
    finding.fields = {CalibrationField::line_delay};
  } else if (change.kind == FindingKind::focal_length || change.kind == FindingKind::principal_point ||
             change.kind == FindingKind::distortion) {
    // If one lens alone were wrong, the stereo pair would show it.
    const bool both = change.kind != FindingKind::principal_point && pair_.judged && pair_.changes.empty();
    lens(change.kind, both ? WhichLens::both : WhichLens::left, change.amount, sigma, change.explained_px);
  }
}

void Examination::gyro_bias(const MotionFit& fit) {
  const Vec3& bias = fit.gyro_bias_radps;
  const double sigma = fit.gyro_bias_sigma_radps.maxCoeff();
  if (bias.norm() < kGyroBiasPractical_radps || bias.norm() < kSignificant * sigma) return;
  Finding& finding = found(FindingKind::gyro_bias, bias.norm(), sigma, "rad/s");
  finding.measured = fmt::format("the gyroscope's bias is ({:.3f}, {:.3f}, {:.3f}) +- {:.3f} rad/s", bias.x(), bias.y(), bias.z(),
                                 finding.sigma);
  finding.expected = fmt::format("less than {} rad/s", kGyroBiasPractical_radps);
  finding.advice = "let the driver measure it at rest and subtract it, or subtract this from the readings";
}

void Examination::time_offset(const MotionFit& fit) {
  const double wrong_s = fit.offset_s - evidence_.rig.time_offset_s;
  if (!certainly(wrong_s, fit.offset_sigma_s, kTimePractical_s)) return;
  Finding& finding = found(FindingKind::time_offset, 1e3 * wrong_s, 1e3 * fit.offset_sigma_s, "ms");
  finding.measured = fmt::format(
      "t_imu = t_image {:+.2f} +- {:.2f} ms at one instant: the IMU's stamps are {:.2f} ms {} than the calibration says",
      1e3 * fit.offset_s, finding.sigma, std::abs(finding.size), finding.size > 0 ? "later" : "earlier");
  finding.expected = fmt::format("t_imu = t_image {:+.2f} ms by the calibration", 1e3 * evidence_.rig.time_offset_s);
  if (has(FindingKind::image_stamps)) {  // an offset of the mean delay: with it a flight may be worse than without
    finding.advice =
        "stamp the images at the moment of exposure, and examine a new recording: no offset corrects stamps that vary";
    return;
  }
  const bool in_blocks = std::ranges::any_of(
      out_.findings, [](const Finding& f) { return f.kind == FindingKind::imu_stamps && f.fields.empty(); });  // no wrong rate
  if (in_blocks) {
    finding.advice =
        "stamp each reading at the moment of measuring, and examine a new recording: no offset corrects stamps that vary";
    return;
  }
  finding.advice = "stamp both at the moment of measuring, or give the offset to the calibration";
  finding.fields = {CalibrationField::time_offset};
  rig_.time_offset_s = fit.offset_s;
}

void Examination::rotation(const MotionFit& fit) {
  const Mat3 wrong = evidence_.rig.T_BC0().R() * fit.R_CB;
  const double sigma = fit.rotation_sigma_rad.maxCoeff(), angle = angle_of(wrong);
  if (!certainly(angle, sigma, kRotationPractical_rad)) return;
  turn_cameras(fit.R_CB);
  const Vec3 axis = so3_log(Quat(wrong)).normalized();
  Finding& finding = found(FindingKind::imu_camera_rotation, kDegreesPerRad * angle, kDegreesPerRad * sigma, "deg");
  finding.measured =
      fmt::format("the IMU is rotated by {:.2f} +- {:.2f} deg from the calibration, about ({:.2f}, {:.2f}, {:.2f}) of the IMU",
                  finding.size, finding.sigma, axis.x(), axis.y(), axis.z());
  finding.expected = "less than 1 deg";
  finding.advice = "correct the cameras' extrinsics (the translations are unchanged), or mount the IMU as calibrated";
  finding.fields = {CalibrationField::mounting_of_left, CalibrationField::mounting_of_right};
}

}  // namespace fbvins
