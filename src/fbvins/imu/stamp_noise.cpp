// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/stamp_noise.hpp"

#include <algorithm>
#include <cmath>

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
/// with the other sign: the difference has six times the variance of one. What lasts longer than a pair, as a gyroscope that drifts,
/// is in neither. The median hides single images that are late.
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

}  // namespace fbvins
