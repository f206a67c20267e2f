// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/gyro_turns.hpp"

#include <algorithm>
#include <iterator>

namespace fbvins {
namespace {

/// Without readings for longer nobody knows how the body turned.
constexpr double kLongestGap_s = 0.05;

}  // namespace

bool GyroTurns::add(const ImuSegment& segment, Time t) {
  // Where the offset was corrected downwards a segment may end before it begins.
  const bool known = !empty() && (t + segment.time_offset - last()).seconds() < kLongestGap_s;
  const bool whole = segment.empty() ? known : segment.longest_gap.seconds() <= kLongestGap_s;
  if (!whole) turned_.clear(), last_rate_.reset();
  for (std::size_t k = 1; k + 1 < segment.samples.size(); ++k)
    add_reading(segment.samples[k].t + segment.time_offset, segment.samples[k].gyro_radps);
  return whole;
}

void GyroTurns::add_reading(Time t, const Vec3& rate) {
  if (!turned_.empty() && t <= turned_.back().t) return;
  if (last_rate_) {
    const double dt = (t - turned_.back().t).seconds();
    turned_.push_back({t, (turned_.back().q * so3_exp(Vec3(0.5 * dt * (*last_rate_ + rate)))).normalized()});
  } else {
    turned_.push_back({t, Quat::Identity()});
  }
  last_rate_ = rate;
}

void GyroTurns::forget_before(Time t) {
  while (turned_.size() > 2 && turned_[1].t < t) turned_.pop_front();
}

/// Between two readings by their mean: at a degree apart it differs from the great circle by less than 1e-6 rad.
Quat GyroTurns::orientation(Time t) const {
  const auto after = std::lower_bound(turned_.begin(), turned_.end(), t, [](const Rotation& r, Time at) { return r.t < at; });
  if (after == turned_.begin()) return after->q;
  if (after == turned_.end()) return turned_.back().q;
  const auto before = std::prev(after);
  const double x = (t - before->t).seconds() / (after->t - before->t).seconds();
  return Quat((1 - x) * before->q.coeffs() + x * after->q.coeffs()).normalized();
}

Vec3 GyroTurns::rate(Time t) const { return so3_log(between(t - kRateOver, t + kRateOver)) / (2 * kRateOver.seconds()); }

}  // namespace fbvins
