// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/stamp_noise.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/hypotenuse.hpp"
#include "fbvins/core/median.hpp"

namespace fbvins {
namespace {

/// Where nothing is wrong, pairs of real images are off by this in the median.
constexpr double kLateUsual_s = 0.0007;
constexpr std::size_t kFewestLate = 10;
/// Relative standard deviation of the variance by the median of n differences: this over the root of n. It is subtracted.
constexpr double kSurely = 2.3;

}  // namespace

/// A pair shows the noise of its two stamps, and so does the pair that begins where it ends, of the stamp between them
/// with the other sign: the difference has six times the variance of one. What lasts longer than a pair, as a gyroscope that
/// drifts, is in neither. The median hides single images that are late.
double stamp_sigma_s(const std::vector<LateImage>& late) {
  std::vector<double> difference_s, known_s2;
  auto before = late.begin();
  for (const LateImage& l : late) {
    while (before->to < l.from) ++before;
    if (before->to != l.from) continue;
    difference_s.push_back(std::abs(l.s - before->s));
    known_s2.push_back(1.5 * (l.known_s2 + before->known_s2));  // of the image between, twice the noise
  }
  if (difference_s.size() < kFewestLate) return 0;
  const double sigma = 1.4826 * median(difference_s), usual = 1.4826 * kLateUsual_s;
  const double surely = 1 - kSurely / std::sqrt(static_cast<double>(difference_s.size()));
  return std::sqrt(std::max(0.0, surely * sigma * sigma - usual * usual - median(known_s2)) / 6);
}

void add_stamp_noise(ImuSegment& imu, const ImuNoise& noise, double stamp_sigma_s, const Vec3& rate_radps,
                     const Vec3& velocity_mps) {
  const double sigma_s = std::sqrt(2.0) * stamp_sigma_s;
  if (imu.empty() || sigma_s == 0) return;
  const double dt = (imu.samples.back().t - imu.samples.front().t).seconds();
  const double turn = sigma_s * rate_radps.norm(), shift = sigma_s * velocity_mps.norm();
  imu.noise.gyro = hypotenuse(imu.noise.gyro, turn / (noise.gyro_noise_density_radps_rthz * std::sqrt(dt)));
  imu.noise.accel = hypotenuse(imu.noise.accel, shift / (noise.accel_noise_density_mps2_rthz * std::sqrt(dt * dt * dt / 3)));
}

}  // namespace fbvins
