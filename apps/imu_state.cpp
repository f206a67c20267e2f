// SPDX-License-Identifier: Apache-2.0
#include "apps/imu_state.hpp"

#include "fbvins/io/imu_state_file.hpp"

namespace fbvins::app {

std::optional<ImuState> imu_state_of(const Odometry& o, double rig_time_offset_s) {
  if (o.health.state != HealthState::good || o.accel_bias_covariance.isZero(0)) return std::nullopt;
  ImuState out{o.t, {o.bias, o.gyro_bias_covariance, o.accel_bias_covariance}};
  if (o.time_offset_sigma_s > 0) out.time_offset = TimeOffsetEstimate{rig_time_offset_s + o.time_offset_s, o.time_offset_sigma_s};
  return out;
}

Result<std::optional<ImuState>> load_imu_state(const std::string& path, const ImuNoise& imu) {
  if (path.empty()) return std::optional<ImuState>();
  return read_imu_state(path, imu);
}

Result<void> save_imu_state(const std::string& path, const std::optional<ImuState>& state, const ImuNoise& imu) {
  if (path.empty() || !state) return {};
  return write_imu_state(path, *state, imu);
}

}  // namespace fbvins::app
