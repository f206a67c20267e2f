// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/imu_series.hpp"

#include <algorithm>

namespace fbvins {
namespace {

constexpr double kLongestGap_s = 0.05;

}  // namespace

ImuSeries::ImuSeries(std::span<const ImuSample> samples) {
  for (const ImuSample& sample : samples)
    if (samples_.empty() || sample.t > samples_.back().t) samples_.push_back(sample);
  integral_.assign(samples_.size(), Vec3::Zero());
  for (std::size_t i = 1; i < samples_.size(); ++i) {
    const double dt = (samples_[i].t - samples_[i - 1].t).seconds();
    integral_[i] = integral_[i - 1] + 0.5 * dt * (samples_[i].gyro_radps + samples_[i - 1].gyro_radps);
  }
}

std::size_t ImuSeries::first_after(Time t) const {
  const auto after =
      std::upper_bound(samples_.begin(), samples_.end(), t, [](Time time, const ImuSample& s) { return time < s.t; });
  return static_cast<std::size_t>(after - samples_.begin());
}

bool ImuSeries::covers(Time a, Time b) const {
  if (empty() || a < samples_.front().t || b > samples_.back().t) return false;
  for (std::size_t i = std::max<std::size_t>(first_after(a), 1); i < samples_.size(); ++i) {
    if ((samples_[i].t - samples_[i - 1].t).seconds() > kLongestGap_s) return false;
    if (samples_[i].t >= b) break;
  }
  return true;
}

ImuSample ImuSeries::at(Time t) const {
  const std::size_t i = first_after(t);
  if (i == 0 || i == samples_.size()) {
    ImuSample held = i == 0 ? samples_.front() : samples_.back();
    held.t = t;
    return held;
  }
  const ImuSample &a = samples_[i - 1], &b = samples_[i];
  const double x = (t - a.t).seconds() / (b.t - a.t).seconds();
  return {t, (1 - x) * a.gyro_radps + x * b.gyro_radps, (1 - x) * a.accel_mps2 + x * b.accel_mps2};
}

Vec3 ImuSeries::integral(Time t) const {
  const std::size_t i = first_after(t);
  if (i == 0) return (t - samples_.front().t).seconds() * samples_.front().gyro_radps;
  const ImuSample& before = samples_[i - 1];
  return integral_[i - 1] + 0.5 * (t - before.t).seconds() * (before.gyro_radps + at(t).gyro_radps);
}

ImuSegment ImuSeries::segment(Time a, Time b) const {
  ImuSegment segment;
  segment.samples.push_back(at(a));
  for (std::size_t i = first_after(a); i < samples_.size() && samples_[i].t < b; ++i) segment.samples.push_back(samples_[i]);
  segment.samples.push_back(at(b));
  return segment;
}

ImuSeries ImuSeries::with_gyro(const Mat3& gyro) const {
  std::vector<ImuSample> changed = samples_;
  for (ImuSample& sample : changed) sample.gyro_radps = gyro * sample.gyro_radps;
  return ImuSeries(changed);
}

ImuSeries ImuSeries::with_accel(Duration later) const {
  std::vector<ImuSample> changed = samples_;
  for (ImuSample& sample : changed) sample.accel_mps2 = at(sample.t + later).accel_mps2;
  return ImuSeries(changed);
}

}  // namespace fbvins
