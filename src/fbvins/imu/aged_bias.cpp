// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/aged_bias.hpp"

#include <algorithm>

namespace fbvins {
namespace {

// From one power-on to the next, as between the recordings of EuRoC's machine halls, which are minutes and days apart.
constexpr double kGyroRepeatability_radps = 1e-3;
constexpr double kAccelRepeatability_mps2 = 0.02;
// As far as biases wander, temperature and age together, however long ago it was.
constexpr double kGyroWander_radps = 5e-3;
constexpr double kAccelWander_mps2 = 0.05;

constexpr double square(double x) { return x * x; }

}  // namespace

ImuBiasEstimate aged(const ImuState& state, Time now, const ImuNoise& noise) {
  const double age_s = (now - state.t).seconds();
  const auto wandered = [&](double walk, double wander) {
    return age_s < 0 ? square(wander) : std::min(square(walk) * age_s, square(wander));
  };
  ImuBiasEstimate out = state.biases;
  out.gyro_covariance.diagonal().array() +=
      square(kGyroRepeatability_radps) + wandered(noise.gyro_random_walk_radps2_rthz, kGyroWander_radps);
  out.accel_covariance.diagonal().array() +=
      square(kAccelRepeatability_mps2) + wandered(noise.accel_random_walk_mps3_rthz, kAccelWander_mps2);
  return out;
}

}  // namespace fbvins
