// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/health_decision.hpp"

#include "fbvins/estimator/integrity_thresholds.hpp"

namespace fbvins {
namespace {

using namespace thresholds;

/// If it holds, the health is this.
struct Rule {
  bool holds;
  HealthState state;
  HealthReason reason;
  std::uint8_t without_cameras = 0;
};

}  // namespace

Health decide_health(const HealthEvidence& e, const HealthLimits& limits) {
  using enum HealthState;
  using R = HealthReason;
  const bool blind = e.few_tracks && e.blind_m > limits.blind_m;
  const bool implausible_bias = e.gyro_bias_radps > kMaxGyroBias_radps || e.accel_bias_mps2 > kMaxAccelBias_mps2;
  // The first rule that holds decides.
  const Rule order[] = {
      // Before the start
      {e.start_refused, initialising, R::alignment_refused},
      {e.waiting_for && e.without_images, initialising, R::no_images},
      {e.waiting_for && e.missing_cameras != 0, initialising, R::one_camera, e.missing_cameras},  // a start needs a pair
      {e.waiting_for.has_value(), initialising, e.waiting_for.value_or(R::none)},
      // There is no estimate any more
      {!e.finite || e.failed_solves >= kFailedSolvesUntilLost, lost, R::solver_failed},
      {blind && e.images_missing, lost, R::no_images},
      {blind, lost, R::no_tracks},
      {e.speed_mps > limits.speed_mps, lost, R::implausible_speed},
      {implausible_bias, lost, R::implausible_bias},
      {e.few_tracks && (e.no_readings || e.longest_gap_s > limits.readings_gap_s), lost, R::imu_gap},
      {e.unrecoverable, lost, R::contradiction},
      // Data that are missing
      {e.failed_solves > 0, degraded, R::solver_failed},
      {e.no_readings || e.after_gap || e.longest_gap_s > kReadingsGap_s, degraded, R::imu_gap},
      {e.images_missing, degraded, R::no_images},
      {e.broken_features > 0, degraded, R::frontend_fault},
      {e.missing_cameras != 0, degraded, R::one_camera, e.missing_cameras},
      {e.landmarks_in_view == 0, degraded, R::no_tracks},
      {e.few_tracks || e.after_dark, degraded, R::few_tracks},
      {e.no_pair_sees, degraded, R::one_camera},
      // Data that are wrong
      {e.wrong_cameras != 0, degraded, R::cameras_disagree, e.wrong_cameras},
      {e.clipped, degraded, R::imu_clipped},
      {e.contradiction, degraded, R::contradiction},
      {e.gyro_vibration_radps > kGyroVibration_radps, degraded, R::imu_vibration},
      // A pose that is right by now, and was not published
      {e.correction == HealthEvidence::Correction::pending, degraded, R::correction_pending},
      {e.correction == HealthEvidence::Correction::made, degraded, R::contradiction},
      // A pose that is as good as without that sensor
      {e.doubted_sensor != R::none, degraded, e.doubted_sensor},
  };
  for (const Rule& rule : order)
    if (rule.holds) return {rule.state, rule.reason, rule.without_cameras};
  return {good, R::none};
}

}  // namespace fbvins
