// SPDX-License-Identifier: Apache-2.0
#include "fbvins/types/odometry.hpp"

namespace fbvins {

std::string_view to_string(HealthState state) {
  switch (state) {
    case HealthState::initialising: return "initialising";
    case HealthState::good: return "good";
    case HealthState::degraded: return "degraded";
    case HealthState::lost: return "lost";
  }
  return "unknown";
}

std::string_view to_string(HealthReason reason) {
  switch (reason) {
    case HealthReason::none: return "none";
    case HealthReason::waiting_for_motion_or_rest: return "waiting_for_motion_or_rest";
    case HealthReason::too_few_features: return "too_few_features";
    case HealthReason::alignment_refused: return "alignment_refused";
    case HealthReason::few_tracks: return "few_tracks";
    case HealthReason::no_tracks: return "no_tracks";
    case HealthReason::no_images: return "no_images";
    case HealthReason::imu_gap: return "imu_gap";
    case HealthReason::implausible_bias: return "implausible_bias";
    case HealthReason::implausible_speed: return "implausible_speed";
    case HealthReason::solver_failed: return "solver_failed";
    case HealthReason::one_camera: return "one_camera";
    case HealthReason::frontend_fault: return "frontend_fault";
    case HealthReason::contradiction: return "contradiction";
    case HealthReason::cameras_disagree: return "cameras_disagree";
    case HealthReason::imu_clipped: return "imu_clipped";
    case HealthReason::imu_vibration: return "imu_vibration";
    case HealthReason::correction_pending: return "correction_pending";
    case HealthReason::range_disagrees: return "range_disagrees";
    case HealthReason::velocity_disagrees: return "velocity_disagrees";
    case HealthReason::pressure_disagrees: return "pressure_disagrees";
  }
  return "unknown";
}

std::string to_sentence(const Health& health) {
  std::string out(to_string(health.state));
  if (health.reason != HealthReason::none) out.append(": ").append(to_string(health.reason));
  const std::vector<int> without = cameras_in(health.without_cameras);
  if (!without.empty()) out += without.size() == 1 ? ", without camera" : ", without cameras";
  for (const int camera : without) out.append(" ").append(std::to_string(camera));
  return out;
}

std::vector<int> cameras_in(std::uint8_t bits) {
  std::vector<int> out;
  for (int c = 0; c < 8; ++c)
    if ((bits >> c & 1) != 0) out.push_back(c);
  return out;
}

}  // namespace fbvins
