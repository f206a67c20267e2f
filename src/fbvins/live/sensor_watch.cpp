// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/sensor_watch.hpp"

#include <algorithm>

namespace fbvins {
namespace {

constexpr double kOverdue_periods = 2.5;

}  // namespace

Health SensorWatch::judge(const Estimated& estimated, const Ingest::Arrival& arrivals, Time started, Time host) const {
  const auto silence_s = [&](const std::optional<Time>& last) { return (host - last.value_or(started)).seconds(); };
  const Health& said = estimated.health;
  // A slow camera is silent only if an image is overdue.
  const double silent_s =
      std::max(options_.camera_silence_s, kOverdue_periods * arrivals.image_period.value_or(Duration{}).seconds());
  double blind_s = silence_s(arrivals.image);
  if (said.has_pose() && estimated.image) blind_s = std::max(blind_s, silence_s(estimated.image));
  unsigned silent = 0;  // bit c: camera c, by its own rate
  for (std::size_t c = 0; c < arrivals.cameras.size(); ++c) {
    const double overdue_s = kOverdue_periods * arrivals.cameras[c].period.value_or(Duration{}).seconds();
    if (silence_s(arrivals.cameras[c].image) > std::max(silent_s, overdue_s)) silent |= 1U << c;
  }
  HealthReason reason = HealthReason::none;
  if (silence_s(arrivals.imu) > options_.imu_silence_s) reason = HealthReason::imu_gap;
  else if (blind_s > silent_s) reason = HealthReason::no_images;
  else if (silent != 0) reason = HealthReason::one_camera;
  if (reason == HealthReason::none) return said;
  const auto worse = [&](HealthState state, HealthReason why, unsigned without = 0) {
    return Health{state, why, static_cast<std::uint8_t>(without)};
  };
  if (!said.has_pose()) return reason == HealthReason::one_camera ? said : worse(said.state, reason);
  if (blind_s > silent_s) {
    const double blind2 = estimated.newest_sigma_m * estimated.newest_sigma_m - estimated.sigma_m * estimated.sigma_m;
    if (blind2 > max_blind_m_ * max_blind_m_) return worse(HealthState::lost, HealthReason::no_images);
    // Images that come wait for readings that do not, and go on without them.
    if (silence_s(arrivals.imu) > max_imu_gap_s_ && silence_s(arrivals.image) > silent_s)
      return worse(HealthState::lost, HealthReason::imu_gap);
  }
  // Images come, and their estimates are late: the estimator knows why, where it waits for readings.
  const bool images_come = reason == HealthReason::no_images && silence_s(arrivals.image) <= silent_s;
  if (images_come && said.state == HealthState::degraded) return said;
  return worse(HealthState::degraded, reason, reason == HealthReason::one_camera ? silent : 0);
}

}  // namespace fbvins
