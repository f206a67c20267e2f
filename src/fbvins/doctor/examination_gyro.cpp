// SPDX-License-Identifier: Apache-2.0
// Time offset, line delay and mounting: where the doctor asks the solver that is used in flight.
#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "fbvins/doctor/examination.hpp"
#include "fbvins/doctor/gyro_fit.hpp"
#include "fbvins/doctor/lens_change.hpp"

namespace fbvins {
namespace {

using doctor::angle_of, doctor::certainly, doctor::kLeastSecondAxis_rad, doctor::kRotationPractical_rad, doctor::kTimePractical_s;

/// Of a third of the recording, so that its time offset is judged by itself.
constexpr double kAgreementOfPart = 0.95;
constexpr std::size_t kFewestPairsOfPart = 20;
/// Smaller errors are not spoken of; from an image's first line to its last one.
constexpr double kReadoutPractical_s = 4e-3;

StereoRig with_lens_of(const MotionFit& fit, StereoRig rig) {
  LensChange lens;
  for (const MotionChange& change : fit.changes) {
    if (change.kind == FindingKind::focal_length) lens.log_focal = change.amount(0);
    if (change.kind == FindingKind::principal_point) lens.centre_px = change.amount;
    if (change.kind == FindingKind::distortion) lens.radial = change.amount;
  }
  rig.cameras[0].camera = changed(rig.left(), lens);
  return rig;
}

ImuSeries with_scale_of(const MotionFit& fit, const ImuSeries& imu) {
  Vec3 factor = Vec3::Ones();
  for (const MotionChange& change : fit.changes)
    if (change.kind == FindingKind::gyro_scale)
      for (int i = 0; i < 3; ++i) factor(i) *= change.axis < 0 || change.axis == i ? std::exp(change.amount(0)) : 1;
  return imu.with_gyro(factor.asDiagonal());
}

}  // namespace

/// Without depths times and mounting are found by themselves, with the lens and the gyroscope's scale that fit best: a residual
/// that measures to epipolar lines alone makes offsets of what it cannot explain. What is not certainly wrong stays as given.
MotionFit Examination::fit_with_gyro() const {
  MotionFit given = fit_motion(pairs_, imu_, {rig_, offset_s_});
  const auto gyro =
      has_depths() ? std::nullopt : fit_gyro(evidence_.frames, with_scale_of(given, imu_), with_lens_of(given, rig_), offset_s_);
  if (!gyro) return given;
  MotionStart start{rig_, rig_.time_offset_s, false, true};
  const double line_off_s = gyro->line_delay_s - rig_.times(0).line_delay_s;
  const double readout_s = line_off_s * rig_.left().height(), sigma_s = gyro->line_delay_sigma_s * rig_.left().height();
  const bool rolling = certainly(readout_s, sigma_s, kReadoutPractical_s);
  if (rolling) start.rig.line_delay_s += line_off_s;
  const bool late = certainly(gyro->offset_s - rig_.time_offset_s, gyro->offset_sigma_s, kTimePractical_s);
  if (late) start.offset_s = gyro->offset_s;
  const double turned = angle_of(rig_.T_BC0().R() * gyro->R_CB);
  const bool rotated = certainly(turned, gyro->rotation_sigma_rad.maxCoeff(), kRotationPractical_rad);
  if (rotated) start.rig.cameras[0].T_BC = {Mat3(gyro->R_CB.transpose()), rig_.T_BC0().p};
  MotionFit fit = fit_motion(pairs_, imu_, start);
  fit.offset_s = gyro->offset_s, fit.R_CB = gyro->R_CB;
  fit.offset_sigma_s = gyro->offset_sigma_s, fit.rotation_sigma_rad = gyro->rotation_sigma_rad;
  if (fit.usable && rolling)
    fit.changes.push_back({FindingKind::rolling_shutter, Eigen::VectorXd::Constant(1, readout_s),
                           Eigen::MatrixXd::Constant(1, 1, sigma_s * sigma_s)});
  return fit;
}

/// The time offset in the first third of the recording against that in the last one.
bool Examination::drift(const MotionFit& fit) {
  StereoRig rig = rig_;
  rig.cameras[0].T_BC = {Mat3(fit.R_CB.transpose()), rig.T_BC0().p};
  const auto part = [&](std::size_t begin, std::size_t end) -> std::optional<GyroFit> {
    const std::vector<FramePair> pairs(pairs_.begin() + static_cast<std::ptrdiff_t>(begin),
                                       pairs_.begin() + static_cast<std::ptrdiff_t>(end));
    const TurnFit turns = fit_turns(pairs, imu_, rig);
    if (!turns.seen || turns.correlation < kAgreementOfPart || turns.spread.y() < kLeastSecondAxis_rad) return std::nullopt;
    const std::size_t first = pairs.front().frame_a, last = pairs.back().frame_b;
    if (!has_depths()) return fit_gyro(std::span(evidence_.frames).subspan(first, last + 1 - first), imu_, rig, turns.offset_s);
    const MotionFit out = fit_motion(pairs, imu_, {rig, turns.offset_s});
    return out.usable ? std::optional(GyroFit{out.offset_s, out.offset_sigma_s}) : std::nullopt;
  };
  const std::size_t third = pairs_.size() / 3;
  if (third < kFewestPairsOfPart) return false;
  const std::optional<GyroFit> first = part(0, third), last = part(pairs_.size() - third, pairs_.size());
  if (!first || !last) return false;
  const double drift_s = last->offset_s - first->offset_s, sigma_s = std::hypot(first->offset_sigma_s, last->offset_sigma_s);
  measured(fmt::format("time offset in the first third of the recording {:.2f} +- {:.2f} ms, in the last one {:.2f} +- {:.2f}",
                       1e3 * first->offset_s, 1e3 * first->offset_sigma_s, 1e3 * last->offset_s, 1e3 * last->offset_sigma_s));
  if (!certainly(drift_s, sigma_s, kTimePractical_s)) return false;
  Finding& finding = found(FindingKind::clocks_drift, 1e3 * drift_s, 1e3 * sigma_s, "ms");
  finding.measured = fmt::format(
      "the IMU's stamps are {:.1f} ms late against the images' in the first third of the recording and {:.1f} ms in the last one (+- {:.1f})",
      1e3 * first->offset_s, 1e3 * last->offset_s, finding.sigma);
  finding.expected = "the same throughout";
  finding.advice =
      "readings or images are lost where stamps are counted up instead of measured, or two clocks run at different speeds: stamp both by one clock";
  return true;
}

}  // namespace fbvins
