// SPDX-License-Identifier: Apache-2.0
// The rate at which an IMU's readings come, whatever a calibration says. Pure function, any thread.
//
//   const double sigma_radps = noise.gyro_noise_density_radps_rthz * std::sqrt(rate_hz_of(readings));
#pragma once

#include <vector>

#include "fbvins/core/median.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// By the median interval; 0 where there is none, or stamps do not increase.
inline double rate_hz_of(const std::vector<ImuSample>& readings) {
  std::vector<double> periods_s;
  for (std::size_t i = 0; i + 1 < readings.size(); ++i) periods_s.push_back((readings[i + 1].t - readings[i].t).seconds());
  const double period_s = median(periods_s);
  return period_s > 0 ? 1 / period_s : 0;
}

}  // namespace fbvins
