// SPDX-License-Identifier: Apache-2.0
#include "fbvins/types/range.hpp"

#include <cmath>

namespace fbvins {

std::string impossible(const RangeSample& r) {
  if (!r.p_B.allFinite() || !r.direction_B.allFinite()) return "a range's place or direction is not finite";
  if (std::abs(r.direction_B.norm() - 1) > 1e-3) return "a range's direction is not of length 1";
  if (!(r.sigma_m > 0)) return "a range's standard deviation is not positive";
  if (!(r.nearest_m >= 0 && r.farthest_m > r.nearest_m)) return "a range's nearest and farthest distance are not in order";
  if (std::isnan(r.distance_m)) return "a range is not a number";
  return "";
}

}  // namespace fbvins
