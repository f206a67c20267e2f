// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/sensor_watch.hpp"

namespace fbvins {

Health SensorWatch::judge(const Health& estimated, const Ingest::Arrival& arrivals, Time started, Time host) const {
  const auto silence_s = [&](const std::optional<Time>& last) { return (host - last.value_or(started)).seconds(); };
  const double blind_s = silence_s(arrivals.image);
  HealthReason reason = HealthReason::none;
  if (silence_s(arrivals.imu) > options_.imu_silence_s) reason = HealthReason::imu_gap;
  else if (blind_s > options_.camera_silence_s) reason = HealthReason::no_images;
  else if (silence_s(arrivals.left) > options_.camera_silence_s || silence_s(arrivals.right) > options_.camera_silence_s)
    reason = HealthReason::one_camera;
  if (reason == HealthReason::none) return estimated;
  if (!estimated.has_pose()) return {estimated.state, reason == HealthReason::one_camera ? estimated.reason : reason};
  if (blind_s > longest_blind_s_) return {HealthState::lost, HealthReason::no_images};
  return {HealthState::degraded, reason};
}

}  // namespace fbvins
