// SPDX-License-Identifier: Apache-2.0
// The accelerometer by the tracks of one camera, without depths: bias, scale and alignment of its axes.
#include <fmt/format.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "fbvins/doctor/axes.hpp"
#include "fbvins/doctor/examination.hpp"
#include "fbvins/doctor/force_problem.hpp"

namespace fbvins {
namespace {

using namespace doctor::force;
using doctor::kSignificant;

constexpr std::size_t kFewestWindows = 6;
constexpr int kRounds = 3;
/// What tracks that are predicted by the readings are off by, at most, for the accelerometer to be judged.
constexpr double kMostError_px = 1.5, kUnpredicted_px = 10;
/// For other axes than those delivered to be named. A handheld rig whose accelerometer has the wrong sign is predicted to 0.30 px
/// with the right axes and to 1.5 and more with any other; a vehicle that hardly accelerates to 0.56 and 0.81 with wrong ones,
/// where the right ones are no better than 1.7.
constexpr double kMostErrorOfAxes_px = 0.75, kNextBest = 2;
/// A change must leave less than this share of the error.
constexpr double kLeaves = 0.97;
constexpr double kBiasPractical_mps2 = 1;

/// The bias is always estimated: without turns gravity does not tell it from a scale, and each IMU has one.
const ChangeGroup kBiasGroup{FindingKind::accel_bias, WhichLens::left, {kBias, kBias + 1, kBias + 2}, kBiasPractical_mps2};

const std::vector<ChangeGroup>& groups() {
  static const std::vector<ChangeGroup> all{
      {FindingKind::accel_scale, WhichLens::left, {kScale}, 0.03},
      {FindingKind::accel_scale, WhichLens::left, {kAxis}, 0.03, 1.01},
      {FindingKind::accel_scale, WhichLens::left, {kAxis + 1}, 0.03, 1.01},
      {FindingKind::accel_scale, WhichLens::left, {kAxis + 2}, 0.03, 1.01},
      {FindingKind::accel_alignment, WhichLens::left, {kCross, kCross + 1, kCross + 2, kCross + 3, kCross + 4, kCross + 5}, 0.03},
  };
  return all;
}

/// Norm of what is significant of an amount: of a bias along an axis that the motion does not show nothing is said.
double significant_part(const Amount& amount) {
  double square = 0;
  for (Eigen::Index i = 0; i < amount.value.size(); ++i)
    if (std::abs(amount.value(i)) > kSignificant * std::sqrt(amount.covariance(i, i))) square += std::pow(amount.value(i), 2);
  return std::sqrt(square);
}

ImuSeries with_force(const ImuSeries& imu, const Mat3& by) {
  std::vector<ImuSample> samples = imu.samples();
  for (ImuSample& sample : samples) sample.accel_mps2 = by * sample.accel_mps2;
  return ImuSeries(samples);
}

}  // namespace

Examination::AxesTried Examination::tracks_with(const Mat3& axes, bool and_bias) const {
  ForceProblem problem(windows_of(evidence_, with_force(imu_, axes), rig_, offset_s_, gyro_bias_), rig_.T_BC0().p,
                       rig_.left().focal_px());
  problem.begin();
  problem.free = kBiasGroup.unknowns;
  if (and_bias && problem.windows() >= kFewestWindows) problem.converge();
  return {axes, problem.windows() < kFewestWindows ? kUnpredicted_px : problem.typical_error()};
}

/// Whether other axes of the accelerometer, one of 48, predict the tracks, where those as delivered do not: a force of the wrong
/// sign puts the scene behind the camera, and gravity is turned by the wrong axis.
bool Examination::force_axes() {
  AxesTried best{Mat3::Identity(), kUnpredicted_px}, second = best;
  for (const Mat3& axes : signed_permutations()) {
    const AxesTried tried = tracks_with(axes, false);
    if (tried.error_px < best.error_px) second = std::exchange(best, tried);
    else if (tried.error_px < second.error_px) second = tried;
  }
  best = tracks_with(best.axes, true), second = tracks_with(second.axes, true);
  measured(fmt::format(
      "tracks predicted by the readings with the accelerometer's axes ({}): error {:.2f} px, with the next best {:.2f}",
      axes_text(best.axes), best.error_px, second.error_px));
  if (best.axes == Mat3::Identity() || best.error_px > kMostErrorOfAxes_px || second.error_px < kNextBest * best.error_px)
    return false;
  Finding& finding = found(FindingKind::accel_axes, best.error_px, 0, "px");
  finding.measured = fmt::format(
      "with the accelerometer's axes as delivered the readings do not predict what the images show, with ({}) they do, to {:.2f} px (with the next best axes {:.2f})",
      axes_text(best.axes), best.error_px, second.error_px);
  finding.expected = "(x, y, z), as the gyroscope's";
  finding.advice = fmt::format("pass ({}) as (x, y, z) of the specific force", axes_text(best.axes));
  if (best.axes == Mat3(-Mat3::Identity()))
    finding.advice += ": at rest with z up the accelerometer reads +9.81 along z, what holds it up, not gravity";
  imu_ = with_force(imu_, best.axes);
  return true;
}

void Examination::force() {
  if (!has_depths() && accel_unit_ != 1) imu_ = with_force(imu_, accel_unit_ * Mat3::Identity());
  ForceProblem problem(windows_of(evidence_, imu_, rig_, offset_s_, gyro_bias_), rig_.T_BC0().p, rig_.left().focal_px());
  problem.free = kBiasGroup.unknowns;
  problem.begin();
  std::optional<BlockSolution> last = problem.windows() < kFewestWindows ? std::nullopt : problem.converge();
  const double with_bias_px = problem.typical_error();
  if (!last || problem.windows() < kFewestWindows || with_bias_px > kMostError_px) {
    if (!has_depths() && !has(FindingKind::accel_axes) && force_axes()) return force();
    if (!has_depths())
      not_judged(
          "scale, bias and axes of the accelerometer: too few tracks, or the readings do not predict them; record faster motions, by hand to and fro along all axes, before a textured scene");
    return;
  }
  std::vector<const ChangeGroup*> found{&kBiasGroup};
  for (int round = 0; round < kRounds; ++round) {
    auto best = best_candidate(problem, groups());
    if (!best) break;
    const Amount amount = amount_of(*best->group, best->fit, best->solution);
    const double before_px = problem.typical_error(), after_px = best->fit.typical_error();
    measured(fmt::format("  force: {} {:.3f} +- {:.3f}, {:.1f} sigmas, error {:.2f} -> {:.2f} px", to_string(best->group->kind),
                         amount.value.norm(), amount.covariance.diagonal().cwiseSqrt().norm(), amount.sigmas(), before_px,
                         after_px));
    if (amount.sigmas() <= kSignificant || after_px > kLeaves * before_px) break;
    found.push_back(best->group);
    last = best->solution;
    problem = std::move(best->fit);
  }
  const Amount bias = amount_of(kBiasGroup, problem, *last);
  const Eigen::VectorXd sigma = bias.covariance.diagonal().cwiseSqrt();
  measured(fmt::format(
      "tracks predicted by the readings ({} windows): error {:.2f} px, after the changes {:.2f}; accelerometer's bias by them ({:.2f} +- {:.2f}, {:.2f} +- {:.2f}, {:.2f} +- {:.2f})",
      problem.windows(), with_bias_px, problem.typical_error(), -bias.value(0), sigma(0), -bias.value(1), sigma(1),
      -bias.value(2), sigma(2)));
  for (const ChangeGroup* group : found) {
    const Amount amount = amount_of(*group, problem, *last);
    const double sigma_max = amount.covariance.diagonal().cwiseSqrt().maxCoeff();
    const bool certain = group != &kBiasGroup || amount.value.norm() > kSignificant * sigma_max;
    if (certain && significant_part(amount) >= group->practical) force_change(*group, amount);
  }
  // A mean reading that is not gravity's is told by its cause.
  if (may_be_bias_ && (has(FindingKind::accel_bias) || has(FindingKind::accel_scale)))
    std::erase_if(out_.findings, [](const Finding& f) { return f.kind == FindingKind::accel_units; });
}

void Examination::force_change(const ChangeGroup& group, const Amount& amount) {
  const double sigma = amount.covariance.diagonal().cwiseSqrt().maxCoeff();
  if (group.kind == FindingKind::accel_bias && !has(FindingKind::accel_bias)) {
    std::erase_if(out_.not_judged, [](const std::string& text) { return text.starts_with("the accelerometer's bias"); });
    const Vec3 bias = -amount.value;
    Finding& finding = found(group.kind, bias.norm(), sigma, "m/s^2");
    finding.measured =
        fmt::format("the accelerometer's bias is ({:.2f}, {:.2f}, {:.2f}) +- {:.2f} m/s^2", bias.x(), bias.y(), bias.z(), sigma);
    finding.expected = "less than 1 m/s^2";
    finding.advice = "calibrate the accelerometer in six positions, or subtract this from its readings";
  } else if (group.kind == FindingKind::accel_scale && !has_depths()) {
    const int axis = group.unknowns.front() - kAxis;
    const double factor = std::exp(amount.value(0));
    const std::string along = axis < 0 ? "" : fmt::format(" along {}", "xyz"[axis]);
    Finding& finding = found(group.kind, 100 * (1 / factor - 1), 100 * sigma, "%");
    finding.measured =
        fmt::format("the accelerometer's readings{} are {:.1f} +- {:.1f} % too large", along, finding.size, finding.sigma);
    finding.expected = "within 3 %, and gravity is 9.81 m/s^2";
    finding.advice = fmt::format("multiply the accelerometer's readings{} by {:.4f}, or look up its range", along, factor);
  } else if (group.kind == FindingKind::accel_alignment) {
    Finding& finding = found(group.kind, 100 * amount.value.cwiseAbs().maxCoeff(), 100 * sigma, "%");
    finding.measured = fmt::format(
        "the accelerometer's axes are not square, or not the gyroscope's: true force = (1 {:+.3f} {:+.3f}; {:+.3f} 1 {:+.3f}; {:+.3f} {:+.3f} 1) reading, +- {:.3f}",
        amount.value(0), amount.value(1), amount.value(2), amount.value(3), amount.value(4), amount.value(5), sigma);
    finding.expected = "less than 3 % of one axis in another";
    finding.advice =
        "calibrate scale and axes of the IMU (fbvins calibrate --imu-axes, rs-imu-calibration), and give them to the calibration";
  }
}

}  // namespace fbvins
