// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/recent_motion.hpp"

#include <algorithm>

#include "fbvins/imu/propagation.hpp"

namespace fbvins {
namespace {

constexpr double kRemembered_s = 5;
/// A longer time without readings says nothing of the way.
constexpr double kLongestGap_s = 0.1;

}  // namespace

void RecentMotion::add(const Keyframe& keyframe) {
  const GaugeState& gauge = keyframe.gauge;
  keyframes_.push_back({keyframe.t, {gauge.T_GB, gauge.v_GB, keyframe.imu.bias}, -keyframe.imu.gravity_mps2 * gauge.up_G()});
  for (const ImuSegment& segment : keyframe.imu.segments)
    for (const ImuSample& sample : segment.samples) (void)readings_.add(sample);  // the ends are there twice: refused
  while (keyframes_.size() > 2 && (keyframe.t - keyframes_[1].t).seconds() > kRemembered_s) keyframes_.pop_front();
  readings_.forget_before(keyframes_.front().t);
}

std::optional<Pose<G, B>> RecentMotion::at(Time t) const {
  const auto after = std::lower_bound(keyframes_.begin(), keyframes_.end(), t, [](const Known& k, Time at) { return k.t < at; });
  if (after == keyframes_.end()) return std::nullopt;
  if (after->t == t) return after->state.T_FB;
  if (after == keyframes_.begin()) return std::nullopt;
  const Known& before = *(after - 1);
  const ImuSegment until = readings_.between(before.t, t), whole = readings_.between(before.t, after->t);
  if (until.empty() || whole.empty() || whole.longest_gap.seconds() > kLongestGap_s) return std::nullopt;
  const Pose<G, B> here = propagate(before.state, until, before.gravity_G).T_FB;
  const Pose<G, B> there = propagate(before.state, whole, before.gravity_G).T_FB;
  const double share = (t - before.t).seconds() / (after->t - before.t).seconds();
  const Vec3 turned = so3_log(there.q.conjugate() * after->state.T_FB.q);
  return here.boxplus(share * (after->state.T_FB.p - there.p), share * turned);
}

}  // namespace fbvins
