// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/prediction.hpp"

#include <algorithm>

namespace fbvins {
namespace {

constexpr Duration kMemory = Duration{1'500'000'000};
/// The prior may be this much older than the image that it is propagated to.
constexpr Duration kOldestPrior = Duration{500'000'000};
/// Readings cover an interval if they begin and end at most this far inside it.
constexpr Duration kTolerance = Duration{30'000'000};

}  // namespace

std::optional<CarriedPoint> carry_point(const Camera& camera, const CameraMotion& motion, const Vec2& normalised,
                                        double inverse_depth) {
  Vec3 p = motion.R_ba * normalised.homogeneous();
  if (motion.has_translation) p += inverse_depth * motion.p_ba;
  const auto a_px = camera.project(normalised.homogeneous());
  const auto b_px = camera.project(p);
  if (!a_px || !b_px) return std::nullopt;
  return CarriedPoint{p, *a_px, *b_px};
}

void MotionPredictor::add(const ImuSegment& imu, const StatePrior& prior) {
  if (prior.valid) prior_ = prior;
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
MotionPredictor::State MotionPredictor::carry(const State& from, Time to) const {
  State s = from;
  auto it =
      std::lower_bound(samples_.begin(), samples_.end(), from.t, [](const ImuSample& sample, Time t) { return sample.t < t; });
  if (it == samples_.end()) return s;
  ImuSample last = *it;
  last.t = s.t;
  while (s.t < to) {
    // After the last reading its value is held.
    const bool end = it == samples_.end() || it->t >= to;
    ImuSample next = it == samples_.end() ? last : *it;
    if (end) next.t = to;
    const double dt = (next.t - s.t).seconds();
    if (dt > 0) {
      const Vec3 w = 0.5 * (last.gyro_radps + next.gyro_radps) - prior_.bias.gyro_radps;
      const Vec3 f = 0.5 * (last.accel_mps2 + next.accel_mps2) - prior_.bias.accel_mps2;
      const Vec3 a_G = s.T_GB.q * (so3_exp(0.5 * dt * w) * f) + prior_.gravity_G;
      s.T_GB.p += dt * s.v_GB + 0.5 * dt * dt * a_G;
      s.v_GB += dt * a_G;
      s.T_GB.q = (s.T_GB.q * so3_exp(dt * w)).normalized();
    }
    s.t = next.t;
    last = next;
    if (!end) ++it;
  }
  return s;
}

bool MotionPredictor::state_reaches(Time t) const {
  return prior_.valid && prior_.t <= t && t - prior_.t < kOldestPrior && covers(prior_.t, t);
}

MotionPredictor::State MotionPredictor::state_at(Time t) const { return carry({prior_.t, prior_.T_GB, prior_.v_GB}, t); }

std::optional<Pose<G, C0>> MotionPredictor::camera_at(Time t) const {
  if (!state_reaches(t)) return std::nullopt;
  return state_at(t).T_GB * T_BC0_;
}

CameraMotion MotionPredictor::between(Time a, Time b) const {
  CameraMotion motion;
  if (!(b > a) || !covers(a, b)) return motion;
  State at_a;
  at_a.t = a;
  const bool with_state = state_reaches(a);
  if (with_state) at_a = state_at(a);
  const State at_b = carry(at_a, b);
  const Pose<C0, C0> T_ba = (at_b.T_GB * T_BC0_).inverse() * (at_a.T_GB * T_BC0_);
  motion.R_ba = T_ba.R();
  motion.has_rotation = true;
  if (with_state) {
    motion.p_ba = T_ba.p;
    motion.has_translation = true;
  }
  return motion;
}

Pose<C1, C0> MotionPredictor::at_exposures(const Pose<C1, C0>& T_C1C0, Time left, Time right) const {
  if (left == right) return T_C1C0;
  const CameraMotion motion = between(std::min(left, right), std::max(left, right));
  const Pose<C0, C0> T_later_earlier(Quat(motion.R_ba), motion.p_ba);
  return T_C1C0 * (right < left ? T_later_earlier.inverse() : T_later_earlier);
}

}  // namespace fbvins
