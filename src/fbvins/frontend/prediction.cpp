// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/prediction.hpp"

#include <algorithm>

namespace fbvins {
namespace {

constexpr Duration kMemory = Duration{1'500'000'000};
/// The prior may be this much older than image a.
constexpr Duration kOldestPrior = Duration{500'000'000};
/// Between the ends of an interval and the readings inside it there may be this much.
constexpr Duration kTolerance = Duration{30'000'000};

}  // namespace

void MotionPredictor::add(const ImuSegment& imu) {
  for (const ImuSample& sample : imu.samples)
    if (samples_.empty() || sample.t > samples_.back().t) samples_.push_back(sample);
  if (!samples_.empty()) forget_before(samples_.back().t - kMemory);
}

void MotionPredictor::forget_before(Time t) {
  while (!samples_.empty() && samples_.front().t < t) samples_.pop_front();
}

bool MotionPredictor::covers(Time a, Time b) const {
  return samples_.size() >= 2 && samples_.front().t <= a + kTolerance && samples_.back().t + kTolerance >= b;
}

/// Midpoint integration over the readings in [from.t, to].
MotionPredictor::State MotionPredictor::carry(const State& from, Time to, const ImuBias& bias, const Vec3& gravity_W) const {
  State s = from;
  auto it =
      std::lower_bound(samples_.begin(), samples_.end(), from.t, [](const ImuSample& sample, Time t) { return sample.t < t; });
  if (it == samples_.end()) return s;
  ImuSample last = *it;
  last.t = s.t;
  while (s.t < to) {
    // Beyond the last reading the last value holds.
    const bool end = it == samples_.end() || it->t >= to;
    ImuSample next = it == samples_.end() ? last : *it;
    if (end) next.t = to;
    const double dt = (next.t - s.t).seconds();
    if (dt > 0) {
      const Vec3 w = 0.5 * (last.gyro_radps + next.gyro_radps) - bias.gyro_radps;
      const Vec3 f = 0.5 * (last.accel_mps2 + next.accel_mps2) - bias.accel_mps2;
      const Vec3 a_W = s.T_WB.q * (so3_exp(0.5 * dt * w) * f) + gravity_W;
      s.T_WB.p += dt * s.v_WB + 0.5 * dt * dt * a_W;
      s.v_WB += dt * a_W;
      s.T_WB.q = (s.T_WB.q * so3_exp(dt * w)).normalized();
    }
    s.t = next.t;
    last = next;
    if (!end) ++it;
  }
  return s;
}

std::optional<Pose<W, C0>> MotionPredictor::camera_at(Time t, const StatePrior& prior) const {
  if (!prior.valid || prior.t > t || t - prior.t >= kOldestPrior || !covers(prior.t, t)) return std::nullopt;
  return carry({prior.t, prior.T_WB, prior.v_WB}, t, prior.bias, prior.gravity_W).T_WB * T_BC0_;
}

CameraMotion MotionPredictor::between(Time a, Time b, const StatePrior& prior) const {
  CameraMotion motion;
  if (!(b > a) || !covers(a, b)) return motion;
  State at_a;
  at_a.t = a;
  const bool with_state = prior.valid && prior.t <= a && a - prior.t < kOldestPrior && covers(prior.t, a);
  if (with_state) at_a = carry({prior.t, prior.T_WB, prior.v_WB}, a, prior.bias, prior.gravity_W);
  const State at_b = carry(at_a, b, prior.bias, prior.gravity_W);
  const Pose<C0, C0> T_ba = (at_b.T_WB * T_BC0_).inverse() * (at_a.T_WB * T_BC0_);
  motion.R_ba = T_ba.R();
  motion.has_rotation = true;
  if (with_state) {
    motion.p_ba = T_ba.p;
    motion.has_translation = true;
  }
  return motion;
}

}  // namespace fbvins
