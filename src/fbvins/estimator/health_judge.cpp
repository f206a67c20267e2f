// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/health_judge.hpp"

#include <algorithm>

namespace fbvins {
namespace {

constexpr double kImuGapDegraded_s = 0.05;
/// Between images farther apart than this, and than this many periods of the camera, others are missing.
constexpr double kImageHole_s = 0.25, kImageHole_periods = 2.5;
constexpr int kFailedSolvesUntilLost = 3;
/// Larger biases are implausible.
constexpr double kMaxGyroBias_radps = 0.5;
constexpr double kMaxAccelBias_mps2 = 2.5;

/// Of eight vehicles one shakes up to this in flight, the others half of it at most, and crashes three times as much.
constexpr double kGyroVibrationDegraded_radps = 0.3;

bool without_images(const TrackedFrame& frame) {
  return !frame.has_left && !frame.has_right && std::ranges::count(frame.has_more, true) == 0;
}

Health lost(HealthReason reason) { return {HealthState::lost, reason}; }
Health degraded(HealthReason reason, std::uint8_t without_cameras = 0) {
  return {HealthState::degraded, reason, without_cameras};
}

}  // namespace

Health HealthJudge::before_start(const TrackedFrame& frame, HealthReason reason) const {
  if (without_images(frame)) reason = HealthReason::no_images;
  else if (const std::uint8_t missing = missing_cameras(frame); missing != 0)  // a start needs a pair
    return {HealthState::initialising, HealthReason::one_camera, missing};
  return {HealthState::initialising, reason};
}

void HealthJudge::pass(const TrackedFrame& frame) {
  if (without_images(frame)) return;
  if (previous_image_) image_period_.add(frame.t - *previous_image_);
  previous_image_ = frame.t;
}

/// Bits, as in Health.
std::uint8_t HealthJudge::missing_cameras(const TrackedFrame& frame) const {
  unsigned missing = 0;
  for (int c = 0; c < cameras_; ++c) {
    const auto k = static_cast<std::size_t>(c);
    const bool here = c == 0 ? frame.has_left : c == 1 ? frame.has_right : k - 2 < frame.has_more.size() && frame.has_more[k - 2];
    if (!here) missing |= 1u << c;
  }
  return static_cast<std::uint8_t>(missing);
}

/// No camera's image came, or these are the first ones after a gap.
bool HealthJudge::images_missing(const TrackedFrame& frame) const {
  if (without_images(frame)) return true;
  const double hole_s = std::max(kImageHole_s, kImageHole_periods * image_period_.median().value_or(Duration{}).seconds());
  return previous_image_ && (frame.t - *previous_image_).seconds() > hole_s;
}

Health HealthJudge::judge(const TrackedFrame& frame, const NavState<G>& state, int landmarks_in_view, const Evidence& evidence) {
  const bool few_tracks = landmarks_in_view < options_.min_tracks;
  if (!few_tracks) seen_sigma_m_ = evidence.worst_sigma_m;
  const double blind2 = evidence.worst_sigma_m * evidence.worst_sigma_m - seen_sigma_m_ * seen_sigma_m_;
  const bool no_imu = frame.imu.empty();

  if (!state.T_FB.p.allFinite() || evidence.failed_solves >= kFailedSolvesUntilLost) return lost(HealthReason::solver_failed);
  if (few_tracks && blind2 > options_.max_blind_m * options_.max_blind_m)
    return lost(images_missing(frame) ? HealthReason::no_images : HealthReason::no_tracks);
  if (state.v_FB.norm() > options_.max_speed_mps) return lost(HealthReason::implausible_speed);
  if (state.bias.gyro_radps.norm() > kMaxGyroBias_radps || state.bias.accel_mps2.norm() > kMaxAccelBias_mps2)
    return lost(HealthReason::implausible_bias);
  if (few_tracks && (no_imu || frame.imu.longest_gap.seconds() > options_.max_imu_gap_s)) return lost(HealthReason::imu_gap);
  if (evidence.hopeless) return lost(HealthReason::contradiction);
  if (evidence.failed_solves > 0) return degraded(HealthReason::solver_failed);
  if (no_imu || evidence.after_gap || frame.imu.longest_gap.seconds() > kImuGapDegraded_s) return degraded(HealthReason::imu_gap);
  if (images_missing(frame)) return degraded(HealthReason::no_images);
  if (evidence.broken_features > 0) return degraded(HealthReason::frontend_fault);
  if (const std::uint8_t missing = missing_cameras(frame); missing != 0) return degraded(HealthReason::one_camera, missing);
  if (landmarks_in_view == 0) return degraded(HealthReason::no_tracks);
  if (few_tracks || evidence.after_dark) return degraded(HealthReason::few_tracks);
  if (stereo_ && frame.stats.stereo == 0) return degraded(HealthReason::one_camera);
  if (evidence.wrong_cameras != 0) return degraded(HealthReason::cameras_disagree, evidence.wrong_cameras);
  if (evidence.clipped) return degraded(HealthReason::imu_clipped);
  if (evidence.contradiction) return degraded(HealthReason::contradiction);
  if (evidence.gyro_vibration_radps > kGyroVibrationDegraded_radps) return degraded(HealthReason::imu_vibration);
  return {HealthState::good, HealthReason::none};
}

}  // namespace fbvins
