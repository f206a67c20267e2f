// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/sensor_doubt.hpp"

#include <algorithm>

namespace fbvins {

void SensorDoubt::count(Time t, bool used) {
  constexpr double kLongest_s = 0.5;  // a silence says nothing
  const double since_s = newest_ ? std::min(kLongest_s, (t - *newest_).seconds()) : 0;
  newest_ = t;
  left_out_s_ = std::clamp(left_out_s_ + (used ? -since_s : since_s), 0.0, 2 * after_s_);
}

}  // namespace fbvins
