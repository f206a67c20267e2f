// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/live_estimate.hpp"

#include "fbvins/types/protection.hpp"

namespace fbvins {

std::optional<LivePose> LiveEstimate::add(const ImuSample& reading, Time host_t) {
  const std::lock_guard lock(mutex_);
  std::optional<LivePose> pose = propagator_.add(reading);
  if (!pose) return std::nullopt;
  pose->reset_counter = reset_counter_;  // before the first estimate, too
  pose->host_t = host_t;
  if (pose->health.has_pose()) {
    estimated_.newest_sigma_m = worst_sigma_m(pose->pose_covariance);
    pose->health = health_;  // without a pose the propagator has none, whatever `health_` says
  }
  if (estimated_.image) age_.add(host_t - *estimated_.image);
  return pose;
}

std::optional<LivePose> LiveEstimate::add(const Odometry& estimate, Time image_host_t) {
  const std::lock_guard lock(mutex_);
  std::optional<LivePose> pose = propagator_.rebase(estimate);
  estimated_.health = estimate.health;
  resets_ += estimate.reset_counter - reset_counter_;
  reset_counter_ = estimate.reset_counter;
  ++images_;
  if (estimate.health.has_pose()) {
    estimated_.image = image_host_t;
    estimated_.sigma_m = estimated_.newest_sigma_m = worst_sigma_m(estimate.pose_covariance);
  }
  if (pose) pose->reset_counter = reset_counter_, pose->host_t = image_host_t;
  return pose;
}

bool LiveEstimate::judge(const Ingest::Arrival& arrivals, Time host) {
  const std::lock_guard lock(mutex_);
  const Health now = watch_.judge(estimated_, arrivals, started_, host);
  const bool changed = !(now == health_);
  health_ = now;
  return changed;
}

void LiveEstimate::tell(LiveStatus& status) const {
  status.pose_age = age_.summary();
  const std::lock_guard lock(mutex_);
  status.health = health_;
  status.reset_counter = reset_counter_;
  status.counts.images_estimated = images_;
  status.counts.resets = resets_;
}

}  // namespace fbvins
