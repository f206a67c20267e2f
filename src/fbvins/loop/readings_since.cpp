// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/readings_since.hpp"

#include "fbvins/loop/place_map.hpp"

namespace fbvins {

void ReadingsSince::add(const std::vector<ImuSegment>& read, Time t, std::optional<Time> newest_t) {
  if (!newest_t || read.empty() || (t - *newest_t).seconds() > kLongestImu_s) missing_ = true;
  if (missing_) readings_.clear();
  else readings_.insert(readings_.end(), read.begin(), read.end());
}

std::shared_ptr<const Preintegration> ReadingsSince::until(Time t, Time newest_t, const KeyframeImu& imu) const {
  if (missing_) return nullptr;
  Preintegration between(imu.noise, imu.bias);
  for (const ImuSegment& segment : readings_) between.integrate(segment);
  if (between.begin() != newest_t || between.end() != t) return nullptr;
  return std::make_shared<const Preintegration>(std::move(between));
}

void ReadingsSince::restart() {
  readings_.clear();
  missing_ = false;
}

}  // namespace fbvins
