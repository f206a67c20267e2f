// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/health_judge.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/estimator/integrity_thresholds.hpp"

namespace fbvins {
namespace {

using namespace thresholds;

bool without_images(const TrackedFrame& frame) { return std::ranges::count(frame.cameras, true) == 0; }

}  // namespace

Health HealthJudge::before_start(const TrackedFrame& frame, HealthReason reason) {
  evidence_ = {.waiting_for = reason, .without_images = without_images(frame), .missing_cameras = missing_cameras(frame)};
  return decide();
}

Health HealthJudge::contradicted() {
  evidence_.contradiction = true;
  return decide();
}

Health HealthJudge::start_refused() {
  evidence_.start_refused = true;
  return decide();
}

Health HealthJudge::corrected(HealthEvidence::Correction correction) {
  evidence_.correction = correction;
  return decide();
}

Health HealthJudge::decide() const {
  return decide_health(evidence_, {options_.max_blind_m, options_.max_speed_mps, options_.max_imu_gap_s});
}

void HealthJudge::pass(const TrackedFrame& frame) {
  if (without_images(frame)) return;
  if (previous_image_) image_period_.add(frame.t - *previous_image_);
  previous_image_ = frame.t;
}

/// Bits, as in Health.
std::uint8_t HealthJudge::missing_cameras(const TrackedFrame& frame) const {
  unsigned missing = 0;
  for (int c = 0; c < cameras_; ++c)
    if (!frame.has(c)) missing |= 1u << c;
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
  evidence_ = {.without_images = without_images(frame),
               .images_missing = images_missing(frame),
               .missing_cameras = missing_cameras(frame),
               .broken_features = evidence.broken_features,
               .landmarks_in_view = landmarks_in_view,
               .few_tracks = few_tracks,
               .blind_m = std::sqrt(std::max(0.0, blind2)),
               .no_pair_sees = stereo_ && frame.stats.stereo == 0,
               .after_dark = evidence.after_dark,
               .no_readings = frame.imu.empty(),
               .longest_gap_s = frame.imu.longest_gap.seconds(),
               .after_gap = evidence.after_gap,
               .clipped = evidence.clipped,
               .gyro_vibration_radps = evidence.gyro_vibration_radps,
               .finite = state.T_FB.p.allFinite(),
               .failed_solves = evidence.failed_solves,
               .speed_mps = state.v_FB.norm(),
               .gyro_bias_radps = state.bias.gyro_radps.norm(),
               .accel_bias_mps2 = state.bias.accel_mps2.norm(),
               .contradiction = evidence.contradiction,
               .unrecoverable = evidence.unrecoverable,
               .wrong_cameras = evidence.wrong_cameras,
               .doubted_sensor = evidence.doubted_sensor};
  return decide();
}

}  // namespace fbvins
