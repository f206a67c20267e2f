// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/imu_order.hpp"

namespace fbvins {
namespace {

/// A longer interval than this is a gap; a shorter one is a period with jitter.
constexpr double kHole_periods = 1.6;

}  // namespace

void ImuOrder::push(const ImuSample& sample, Time host, const Release& release) {
  if (newest_ && sample.t <= *newest_) {
    ++late_;
    return;
  }
  if (!waiting_.empty() && sample.t < waiting_.rbegin()->first) ++reordered_;
  waiting_.insert_or_assign(sample.t, Waiting{sample, host});
  tick(host, release);
}

void ImuOrder::tick(Time host, const Release& release) {
  while (!waiting_.empty()) {
    const Waiting& front = waiting_.begin()->second;
    if (!is_next(front.sample.t) && host - front.since < longest_wait_) return;
    release_front(release);
  }
}

void ImuOrder::flush(const Release& release) {
  while (!waiting_.empty()) release_front(release);
}

bool ImuOrder::is_next(Time t) const {
  const std::optional<Duration> period = period_.median();
  return !newest_ || !period || (t - *newest_).seconds() < kHole_periods * period->seconds();
}

void ImuOrder::release_front(const Release& release) {
  const ImuSample sample = waiting_.begin()->second.sample;
  waiting_.erase(waiting_.begin());
  if (newest_) period_.add(sample.t - *newest_);
  newest_ = sample.t;
  release(sample);
}

}  // namespace fbvins
