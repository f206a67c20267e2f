// SPDX-License-Identifier: Apache-2.0
// The accelerometer against the accelerations that the images show, and what follows for the camera's place and the baseline.
#include "fbvins/doctor/examination.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "fbvins/checkup/reading_units.hpp"
#include "fbvins/doctor/axes.hpp"
#include "fbvins/imu/nav_state.hpp"

namespace fbvins {
namespace {

using doctor::kSignificant;

/// Delays of the accelerometer beside the gyroscope that are tried, and what the best must leave of the unexplained.
constexpr double kDelayStep_s = 0.02, kDelayPractical_s = 0.015, kDelayLeaves = 0.7;
constexpr int kDelaySteps = 4;
constexpr double kScalePractical = 0.03, kPositionPractical_m = 0.05, kBiasPractical_mps2 = 1;
/// Gravity may be farther off by this without a bias than with it.
constexpr double kBiasSpares_mps2 = 0.2;
/// Significance that the images' scale needs where gravity, as the accelerometer reads it, is off by the same factor.
constexpr double kConfirmed = 3;
/// Gravity must be nearer to one cause's than to another's by this share.
constexpr double kGravityTells = 0.01;
/// How much nearer the place that turned with the IMU must be than that as given, in standard deviations, and the least of those.
constexpr double kTurnedTells = 3, kLeverResolution_m = 0.003;
/// Another place of the camera must leave less than this share of what is unexplained.
constexpr double kElsewhereLeaves = 0.8;

/// The readings with the specific force in m/s^2.
ImuSeries in_unit(const ImuSeries& imu, double unit_mps2) {
  std::vector<ImuSample> changed = imu.samples();
  for (ImuSample& sample : changed) sample.accel_mps2 *= unit_mps2;
  return ImuSeries(changed);
}

/// Of a parabola through three values a step apart, from the middle one, in steps.
double lowest_between(double before, double at, double after) {
  const double bend = before - 2 * at + after;
  return bend > 1e-12 ? 0.5 * (before - after) / bend : 0;
}

}  // namespace

/// The fit with the accelerometer's delay beside the gyroscope that explains most, if that is much more than none does.
AccelFit Examination::in_step(AccelFit as_stamped) {
  constexpr std::size_t kTried = 2 * kDelaySteps + 1;
  const auto later = [&](double steps) { return Duration::from_seconds(steps * kDelayStep_s); };
  std::array<double, kTried> unexplained{};
  std::size_t best = kDelaySteps;
  for (std::size_t i = 0; i < kTried; ++i) {
    const Duration d = later(static_cast<double>(i) - kDelaySteps);
    unexplained[i] = i == kDelaySteps ? as_stamped.unexplained
                                      : fit_accelerations(pairs_, imu_.with_accel(d), rig_, {offset_s_, gyro_bias_}).unexplained;
    if (unexplained[i] < unexplained[best]) best = i;
  }
  if (best == 0 || best + 1 == kTried) return as_stamped;
  const double steps =
      static_cast<double>(best) - kDelaySteps + lowest_between(unexplained[best - 1], unexplained[best], unexplained[best + 1]);
  const double late_s = steps * kDelayStep_s;
  if (std::abs(late_s) < kDelayPractical_s) return as_stamped;
  const ImuSeries together = imu_.with_accel(later(steps));
  const AccelFit fit = fit_accelerations(pairs_, together, rig_, {offset_s_, gyro_bias_});
  if (!fit.seen || fit.unexplained > kDelayLeaves * as_stamped.unexplained) return as_stamped;
  imu_ = together;
  Finding& finding = found(FindingKind::accel_late, 1e3 * late_s, 0, "ms");
  finding.measured = fmt::format(
      "the accelerometer's readings are {:.0f} ms {} the gyroscope's of the same stamp: {:.1f} % of the acceleration that the images show is unexplained as stamped, {:.1f} % so",
      std::abs(finding.size), late_s > 0 ? "late against" : "ahead of", 100 * as_stamped.unexplained, 100 * fit.unexplained);
  finding.expected = "both measured at the moment of their stamp";
  finding.advice = "read both sensors together, or give each reading the stamp of its own measurement before they are joined";
  return fit;
}

void Examination::accelerations() {
  imu_ = in_unit(imu_, accel_unit_);  // the cameras' place on the IMU is in metres
  AccelFit fit = in_step(fit_accelerations(pairs_, imu_, rig_, {offset_s_, gyro_bias_}));
  measured(fmt::format(
      "accelerations seen: {:.2f} m/s^2, {:.1f} % unexplained by the accelerometer ({:.1f} % with its axes as delivered, best: {}); scale {:.4f} +- {:.4f}, gravity {:.2f} +- {:.2f} m/s^2",
      fit.acceleration_mps2, 100 * fit.unexplained, 100 * fit.unexplained_as_named, axes_text(fit.axes), fit.scale,
      fit.scale_sigma, fit.gravity_mps2, fit.gravity_sigma_mps2));
  if (!fit.seen) {
    not_judged(
        "axes, scale, bias and delay of the accelerometer, position of the camera on the IMU, length of the baseline: the "
        "rig hardly accelerated");
    return;
  }
  measured(fmt::format(
      "accelerometer's bias ({:.2f} +- {:.2f}, {:.2f} +- {:.2f}, {:.2f} +- {:.2f}); the camera's position on the IMU from the calibration's ({:.1f} +- {:.1f}, {:.1f} +- {:.1f}, {:.1f} +- {:.1f}) cm, {:.1f} % unexplained there",
      fit.bias.x(), fit.bias_sigma.x(), fit.bias.y(), fit.bias_sigma.y(), fit.bias.z(), fit.bias_sigma.z(), 100 * fit.lever_m.x(),
      100 * fit.lever_sigma_m.x(), 100 * fit.lever_m.y(), 100 * fit.lever_sigma_m.y(), 100 * fit.lever_m.z(),
      100 * fit.lever_sigma_m.z(), 100 * fit.unexplained_elsewhere));
  if (fit.axes != Mat3::Identity()) {
    accel_axes(fit);
  } else if (position(fit)) {  // which changes the rest
    fit = fit_accelerations(pairs_, imu_, rig_, {offset_s_, gyro_bias_});
  }
  if (fit.axes == Mat3::Identity()) accel_bias(fit);
  accel_scale(fit);
  const auto told = [&](FindingKind kind) {
    return std::ranges::any_of(out_.findings, [&](const Finding& f) { return f.kind == kind; });
  };
  if (may_be_bias_ && (told(FindingKind::accel_bias) || told(FindingKind::accel_scale)))
    std::erase_if(out_.findings, [](const Finding& f) { return f.kind == FindingKind::accel_units; });
}

void Examination::accel_axes(const AccelFit& fit) {
  Finding& finding = found(FindingKind::accel_axes, 100 * fit.unexplained_as_named, 0, "% unexplained");
  finding.measured = fmt::format(
      "with the accelerometer's axes as delivered {:.0f} % of the acceleration that the images show is unexplained, with ({}) {:.0f} %",
      finding.size, axes_text(fit.axes), 100 * fit.unexplained);
  finding.expected = "(x, y, z), as the gyroscope's";
  finding.advice = fmt::format("pass ({}) as (x, y, z) of the specific force", axes_text(fit.axes));
}

/// An IMU that is turned sees the cameras elsewhere, too: where the calibration has them, turned as well, which is more exact
/// than any place that the accelerations show.
bool Examination::turned_with_imu(const AccelFit& fit) {
  const auto rotation = std::ranges::find(out_.findings, FindingKind::imu_camera_rotation, &Finding::kind);
  if (rotation == out_.findings.end()) return false;
  const Mat3 turn = rig_.T_BC0().R() * evidence_.rig.T_BC0().R().transpose();
  const Vec3 with_turn = turn * rig_.T_BC0().p - rig_.T_BC0().p;
  const auto sigmas_from = [&](const Vec3& place) {
    return (fit.lever_m - place).cwiseQuotient(fit.lever_sigma_m.cwiseMax(kLeverResolution_m)).norm();
  };
  if (sigmas_from(with_turn) + kTurnedTells > sigmas_from(Vec3::Zero())) return false;
  if ((fit.lever_m - with_turn).norm() > kPositionPractical_m) return false;
  for (MountedCamera& mounted : rig_.cameras) mounted.T_BC.p += with_turn;
  rotation->advice = "correct the cameras' poses on the IMU, their places with their rotation, or mount the IMU as calibrated";
  return true;
}

bool Examination::position(const AccelFit& fit) {
  if (turned_with_imu(fit)) return true;
  const double away_m = fit.lever_m.norm(), sigma_m = fit.lever_sigma_m.maxCoeff();
  if (away_m < kPositionPractical_m || away_m < kSignificant * sigma_m) return false;
  if (fit.unexplained_elsewhere > kElsewhereLeaves * fit.unexplained) return false;
  for (MountedCamera& mounted : rig_.cameras) mounted.T_BC.p += fit.lever_m;
  Finding& finding = found(FindingKind::imu_camera_position, 1e2 * away_m, 1e2 * sigma_m, "cm");
  finding.measured = fmt::format(
      "the cameras are ({:.1f}, {:.1f}, {:.1f}) +- {:.1f} cm, in the IMU's axes, from where the calibration has them on the IMU",
      1e2 * fit.lever_m.x(), 1e2 * fit.lever_m.y(), 1e2 * fit.lever_m.z(), finding.sigma);
  finding.expected = fmt::format("less than {:.0f} cm", 1e2 * kPositionPractical_m);
  finding.advice = "measure the distances from IMU to cameras, or calibrate them";
  finding.fields = {CalibrationField::mounting_of_left, CalibrationField::mounting_of_right};
  return true;
}

void Examination::accel_bias(const AccelFit& fit) {
  const Vec3& bias = fit.bias;
  if (bias.norm() < kBiasPractical_mps2) return;
  // Without its bias an accelerometer reads gravity better. A rig that turns little hardly tells a bias from gravity.
  const auto gravity_error = [&](const Vec3& without) {
    std::vector<ImuSample> samples = evidence_.imu;
    for (ImuSample& sample : samples) sample.accel_mps2 = accel_unit_ * sample.accel_mps2 - without;
    return std::abs(gravity_seen(samples).norm_mps2 - kGravity_mps2);
  };
  const double as_read = gravity_error(Vec3::Zero()), without = gravity_error(bias);
  if (bias_significance(fit, as_read, without) < kSignificant) return;
  if (without > as_read + kBiasSpares_mps2) {
    not_judged("the accelerometer's bias: what the images show of it does not go with the gravity that it reads");
    return;
  }
  Finding& finding = found(FindingKind::accel_bias, bias.norm(), fit.bias_sigma.maxCoeff(), "m/s^2");
  finding.measured = fmt::format("the accelerometer's bias is ({:.2f}, {:.2f}, {:.2f}) +- {:.2f} m/s^2", bias.x(), bias.y(),
                                 bias.z(), finding.sigma);
  finding.expected = fmt::format("less than {:.0f} m/s^2", kBiasPractical_mps2);
  finding.advice = "calibrate the accelerometer in six positions, or subtract this from its readings";
}

/// The cameras' displacements and the accelerometer's disagree by a factor. Gravity tells whose it is: in metres of the cameras
/// it is wrong by the baseline's error, whatever the accelerometer's scale.
void Examination::accel_scale(const AccelFit& fit) {
  const double factor = 1 / fit.scale, sigma = fit.scale_sigma / fit.scale * factor;
  const double reads = accel_unit_ * gravity_seen(evidence_.imu).norm_mps2 / kGravity_mps2;
  const bool confirmed = std::abs(reads - 1) > kScalePractical && std::abs(reads - factor) < kConfirmed * sigma;
  if (std::abs(factor - 1) < kScalePractical || std::abs(factor - 1) < (confirmed ? kConfirmed : kSignificant) * sigma) return;
  const double gravity = fit.gravity_mps2 / kGravity_mps2;
  const double by_baseline = std::abs(gravity - 1 / factor), by_accelerometer = std::abs(gravity - 1);
  const bool metres_tell = by_baseline + kGravityTells < by_accelerometer;  // those of the images
  if (metres_tell && rig_.has_right()) return baseline_length(factor, sigma);
  Finding& finding = found(FindingKind::accel_scale, 100 * (factor - 1), 100 * sigma, "%");
  finding.measured = fmt::format(
      "the accelerometer's readings are {:.1f} +- {:.1f} % too large for the accelerations that the images show, in which gravity is {:.2f} +- {:.2f} m/s^2",
      finding.size, finding.sigma, fit.gravity_mps2, fit.gravity_sigma_mps2);
  finding.expected = "within 3 %, and gravity is 9.81 m/s^2";
  finding.advice = fmt::format("multiply the accelerometer's readings by {:.4f}, or look up its range", 1 / factor);
  if (metres_tell) finding.advice = fmt::format("multiply the depths by {:.4f}: gravity says that they are wrong", factor);
  else if (std::abs(by_baseline - by_accelerometer) < kGravityTells && !rig_.has_right())
    finding.advice = fmt::format("{}; or the depths by {:.4f}: gravity does not tell which here", finding.advice, factor);
  else if (std::abs(by_baseline - by_accelerometer) < kGravityTells)
    finding.advice = fmt::format("{}; or the baseline is {:.1f} mm long: gravity does not tell which here, so measure it",
                                 finding.advice, 1e3 * rig_.T_C1C0().p.norm() * factor);
}

void Examination::baseline_length(double factor, double sigma) {
  const double length = rig_.T_C1C0().p.norm();
  Finding& finding = found(FindingKind::baseline_length, 1e3 * length * (1 - factor), 1e3 * length * sigma, "mm");
  finding.measured =
      fmt::format("the accelerometer says that the baseline is {:.1f} +- {:.1f} mm long", 1e3 * length * factor, finding.sigma);
  finding.expected = fmt::format("{:.1f} mm by the calibration", 1e3 * length);
  finding.advice =
      "correct the right camera's position (the calibration board's squares were given a wrong size, or the camera was moved)";
  Pose<C1, C0> T_C1C0 = rig_.T_C1C0();
  T_C1C0.p *= factor;
  rig_.cameras[1].T_BC = (rig_.T_BC0() * T_C1C0.inverse()).cast_frames<B, C0>();
  finding.fields = {CalibrationField::mounting_of_right};
}

}  // namespace fbvins
