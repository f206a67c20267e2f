// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/exposure_motion.hpp"

#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace {

/// Rate and acceleration at the stamp are those of the readings of this time before it, the rate with its slope.
constexpr Duration kSlopeOver = Duration{25'000'000};

}  // namespace

ExposureMotion::ExposureMotion(const ImuSegment& readings, const ImuBias& bias, const std::optional<Vec3>& gravity_B_mps2) {
  if (readings.empty()) return;
  const Time end = readings.samples.back().t;
  double n = 0, t = 0, tt = 0;
  Vec3 w = Vec3::Zero(), tw = Vec3::Zero(), f = Vec3::Zero();
  for (const ImuSample& s : readings.samples) {
    if (s.t < end - kSlopeOver) continue;
    const double at = (s.t - end).seconds();
    n += 1, t += at, tt += at * at, w += s.gyro_radps, tw += at * s.gyro_radps, f += s.accel_mps2;
  }
  const double spread = n * tt - t * t;
  if (n >= 3 && spread > 0) slope_radps2_ = (n * tw - t * w) / spread;
  if (gravity_B_mps2) accel_mps2_ = f / n - bias.accel_mps2 + *gravity_B_mps2;
  knots_.push_back({0, Quat::Identity(), (w - t * slope_radps2_) / n - bias.gyro_radps});
  for (auto s = readings.samples.rbegin() + 1; s != readings.samples.rend(); ++s) {
    const Knot& later = knots_.back();
    Knot knot{(s->t - end).seconds(), later.q, s->gyro_radps - bias.gyro_radps};
    knot.q = (later.q * so3_exp(0.5 * (knot.after_s - later.after_s) * (knot.rate_radps + later.rate_radps))).normalized();
    knots_.push_back(knot);
  }
}

Quat ExposureMotion::turn(double after_s) const {
  if (knots_.empty()) return Quat::Identity();
  if (after_s >= 0) return so3_exp(after_s * knots_.front().rate_radps + 0.5 * after_s * after_s * slope_radps2_);
  std::size_t k = 0;  // the last one that is later
  while (k + 1 < knots_.size() && knots_[k + 1].after_s > after_s) ++k;
  const Knot& later = knots_[k];
  Vec3 rate = later.rate_radps;
  if (k + 1 < knots_.size()) {
    const Knot& earlier = knots_[k + 1];
    const double share = (after_s - later.after_s) / (earlier.after_s - later.after_s);
    rate += 0.5 * share * (earlier.rate_radps - later.rate_radps);  // mean from there on
  }
  return later.q * so3_exp((after_s - later.after_s) * rate);
}

}  // namespace fbvins
