// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/survival.hpp"

#include <algorithm>

namespace fbvins {

Survival SurvivalMeter::add(const TrackedFrame& frame) {
  constexpr Duration kSecond{1'000'000'000};
  Sight now{frame.t, {}};
  for (const TrackedFeature& feature : frame.features) now.ids.push_back(feature.id.value);
  std::sort(now.ids.begin(), now.ids.end());
  Survival out;
  // Compares with the newest frame that is at least a second old.
  while (past_.size() > 1 && frame.t - past_[1].t >= kSecond) past_.pop_front();
  if (!past_.empty() && frame.t - past_.front().t >= kSecond) {
    const std::vector<std::int64_t>& then = past_.front().ids;
    out.then = static_cast<long>(then.size());
    out.now = std::count_if(then.begin(), then.end(),
                            [&](std::int64_t id) { return std::binary_search(now.ids.begin(), now.ids.end(), id); });
  }
  past_.push_back(std::move(now));
  return out;
}

}  // namespace fbvins
