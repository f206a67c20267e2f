// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/aged_bias.hpp"

#include <algorithm>

namespace fbvins {
namespace {

// Repeatability from one power-on to the next, as between EuRoC's machine hall recordings, which are minutes to days apart.
constexpr double kGyroRepeatability_radps = 1e-3;
constexpr double kAccelRepeatability_mps2 = 0.02;
// Limit of the random walk, with temperature and ageing, however long ago the estimate was made.
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
