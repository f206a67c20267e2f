// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/gyro_turns.hpp"

#include <algorithm>

namespace fbvins {
namespace {

/// Without readings for longer nobody knows how the body turned.
constexpr double kLongestGap_s = 0.05;

}  // namespace

void GyroTurns::add(const ImuSegment& segment) {
  for (std::size_t k = 1; k + 1 < segment.samples.size(); ++k)
    add_reading(segment.samples[k].t + segment.time_offset, segment.samples[k].gyro_radps);
}

void GyroTurns::clear() {
  turned_.clear(), gaps_.clear();
  last_rate_.reset();
}

void GyroTurns::add_reading(Time t, const Vec3& rate) {
  if (!turned_.empty() && t <= turned_.back().t) return;
  const double dt = turned_.empty() ? 0 : (t - turned_.back().t).seconds();
  if (dt > kLongestGap_s) {
    gaps_.push_back({turned_.back().t, t});
    last_rate_.reset();
  }
  const Quat before = turned_.empty() ? Quat::Identity() : turned_.back().q;
  turned_.push_back({t, last_rate_ ? (before * so3_exp(Vec3(0.5 * dt * (*last_rate_ + rate)))).normalized() : before});
  last_rate_ = rate;
}

void GyroTurns::forget_before(Time t) {
  while (turned_.size() > 2 && turned_[1].t < t) turned_.pop_front();
  while (!gaps_.empty() && gaps_.front().to < t) gaps_.pop_front();
}

bool GyroTurns::covers(Time a, Time b) const {
  if (empty() || a < first() || b > last()) return false;
  return std::ranges::none_of(gaps_, [&](const Gap& gap) { return gap.from < b && a < gap.to; });
}

/// Between two readings by their mean: at a degree apart it differs from the great circle by less than 1e-6 rad.
Quat GyroTurns::orientation(Time t) const {
  if (t <= first()) return turned_.front().q;
  if (t > last()) return turned_.back().q;
  const std::size_t k = not_before(t);
  const Rotation &before = turned_[k - 1], &after = turned_[k];
  const double x = (t - before.t).seconds() / (after.t - before.t).seconds();
  return Quat((1 - x) * before.q.coeffs() + x * after.q.coeffs()).normalized();
}

/// The first reading that is not before t, which lies between the first and the last. Readings are nearly evenly spaced, so it is
/// not far from where it would be if they were.
std::size_t GyroTurns::not_before(Time t) const {
  const double share = (t - first()).seconds() / (last() - first()).seconds();
  std::size_t k = std::min(static_cast<std::size_t>(share * static_cast<double>(turned_.size() - 1)), turned_.size() - 1);
  while (turned_[k].t < t) ++k;
  while (k > 0 && !(turned_[k - 1].t < t)) --k;
  return k;
}

TurnAround GyroTurns::around(Time t, Duration side) const {
  side = std::clamp(side, kLeastSide, kMostSide);
  const double s = side.seconds();
  const Quat here = orientation(t);
  const Vec3 before = so3_log((orientation(t - side).conjugate() * here).normalized());
  const Vec3 after = so3_log((here.conjugate() * orientation(t + side)).normalized());
  return {(before + after) / (2 * s), (after - before) / (s * s)};
}

}  // namespace fbvins
