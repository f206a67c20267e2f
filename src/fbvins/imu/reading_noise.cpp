// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/reading_noise.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/hypotenuse.hpp"

namespace fbvins {
namespace {

constexpr double kMeasured_s = 0.25;
/// What vibration counts as, of white noise of its size: it swings back and forth, a turn much more than a shift. Of six flights
/// of a hexacopter, whose tracks are followed best with 4e-4 rad/s and 0.048 m/s^2 per root Hz (docs/experiments/consistency.md)
/// and whose readings have 2.7e-3 and 0.07.
constexpr double kGyroShare = 0.25, kAccelShare = 1;
/// Axes and scale that are off make an error of a specific force that changes, for as long as a motion lasts.
constexpr double kMotion_s = 0.3, kMean_s = 1;
/// Readings that differ much less from one another than the calibrated noise says have less; filters in the sensor hide this
/// part.
constexpr double kHidden = 3;
/// For single readings: the highest vibration of these flights, about the median of other vehicles, and of noisy sensors so many
/// standard deviations.
constexpr double kUsualGyro_radps = 0.07, kUsualAccel_mps2 = 3.0;
constexpr double kUsualNoise = 3;
/// A single reading that is off by so many times the usual vibration is wrong, or a blow.
constexpr double kOutlier = 6;
/// An axis that gives the same number so often, at a number this large and the largest so far, while the others change, is at the
/// end of its range; it may be wrong by as much again. Readings of which nothing changes are repeated ones.
constexpr int kSameUntilClipped = 4;
constexpr double kOfLargest = 0.9;
constexpr double kClippedGyro_radps = 0.05, kClippedAccel_mps2 = 15;
constexpr double kLeastGyroError_radps = 0.5;
constexpr double kRounding = 1e-9;  ///< of readings whose correction is undone

/// Factor on the noise of readings that differ from one another by `measured` times that noise.
double with_vibration(double measured, double share) {
  return hypotenuse(std::min(1.0, kHidden * measured), share * std::sqrt(std::max(0.0, measured * measured - 1)));
}

/// What the sensor gave before its axes were corrected: an axis at the end of its range is one of the sensor's.
ImuSample as_read(const ImuSample& reading, const ImuIntrinsics& axes) {
  if (axes == ImuIntrinsics{}) return reading;
  return {reading.t, axes.gyro * reading.gyro_radps + axes.gyro_by_force * reading.accel_mps2 + axes.bias.gyro_radps,
          axes.accel * reading.accel_mps2 + axes.bias.accel_mps2};
}

/// Readings in a row with the same large number, 0 before the axis has changed for the first time.
int count_same(int before, double previous, double now, double least, double rounding) {
  if (!(std::abs(now - previous) <= rounding)) return 1;
  return before == 0 || std::abs(now) < least ? std::min(before, 1) : before + 1;
}

}  // namespace

void ReadingNoise::Changes::add(const Vec3& value, double dt_s) {
  if (variance < 0) mean = value, variance = 0;
  const double share = std::min(1.0, dt_s / kMean_s);
  const Vec3 off = value - mean;
  mean += share * off;
  variance += share * (off.squaredNorm() / 3 - variance);
}

void ReadingNoise::add(const ImuSample& reading) {
  if (!last_.empty() && reading.t <= last_.back().t) return;
  if (last_.size() == 2) {
    const ImuSample &a = last_[0], &b = last_[1];
    const Vec3 gyro = a.gyro_radps - 2 * b.gyro_radps + reading.gyro_radps;
    const Vec3 accel = a.accel_mps2 - 2 * b.accel_mps2 + reading.accel_mps2;
    changes_.add(reading.accel_mps2, (reading.t - b.t).seconds());
    differences_.push_back({reading.t, gyro.squaredNorm() / 18, accel.squaredNorm() / 18});  // 3 axes, 1 + 4 + 1
    worst_gyro_radps_ = std::max(worst_gyro_radps_, gyro.norm() / 2);
    worst_accel_mps2_ = std::max(worst_accel_mps2_, accel.norm() / 2);
    const ImuSample now = as_read(reading, assumed_.axes), before = as_read(b, assumed_.axes);
    const double rounding = assumed_.axes == ImuIntrinsics{} ? 0 : kRounding;
    largest_gyro_radps_ = std::max(largest_gyro_radps_, now.gyro_radps.cwiseAbs().maxCoeff());
    const bool repeated = reading.gyro_radps == b.gyro_radps;
    for (int k = 0; k < 3 && !repeated; ++k) {
      gyro_same_[k] = count_same(gyro_same_[k], before.gyro_radps(k), now.gyro_radps(k),
                                 std::max(kClippedGyro_radps, kOfLargest * largest_gyro_radps_), rounding);
      accel_same_[k] = count_same(accel_same_[k], before.accel_mps2(k), now.accel_mps2(k), kClippedAccel_mps2, rounding);
      gyro_clipped_ = gyro_clipped_ || gyro_same_[k] >= kSameUntilClipped;
      accel_clipped_ = accel_clipped_ || accel_same_[k] >= kSameUntilClipped;
    }
    last_.pop_front();
  }
  last_.push_back(reading);
}

ImuNoiseScale ReadingNoise::of(const ImuSegment& segment) {
  ImuNoiseScale out;
  clipped_before_ = gyro_clipped_ || accel_clipped_ ? 4 : std::max(0, clipped_before_ - 1);
  gyro_clipped_ = accel_clipped_ = false;
  worst_gyro_radps_ = worst_accel_mps2_ = 0;
  if (segment.empty()) {
    last_.clear();
    std::fill_n(gyro_same_, 3, 0), std::fill_n(accel_same_, 3, 0);
    return out;
  }
  // The ends of a segment are interpolated at the images' stamps.
  for (std::size_t i = 1; i + 1 < segment.samples.size(); ++i) add(segment.samples[i]);
  const Time now = segment.samples.back().t;
  while (!differences_.empty() && (now - differences_.front().t).seconds() > kMeasured_s) differences_.pop_front();
  if (differences_.empty()) return out;
  double gyro2 = 0, accel2 = 0;
  for (const Difference& d : differences_) gyro2 += d.gyro2, accel2 += d.accel2;
  const auto count = static_cast<double>(differences_.size());
  gyro_radps_ = std::sqrt(gyro2 / count), accel_mps2_ = std::sqrt(accel2 / count);

  const double root_rate = std::sqrt(assumed_.rate_hz);
  const double gyro_sigma = assumed_.gyro_noise_density_radps_rthz * root_rate;  // of a reading
  const double accel_sigma = assumed_.accel_noise_density_mps2_rthz * root_rate;
  const double usual_gyro = std::max(kUsualGyro_radps, kUsualNoise * gyro_sigma);
  const double usual_accel = std::max(kUsualAccel_mps2, kUsualNoise * accel_sigma);
  out = {with_vibration(gyro_radps_ / gyro_sigma, kGyroShare), with_vibration(accel_mps2_ / accel_sigma, kAccelShare)};
  out.accel = hypotenuse(out.accel, axes_ * changes_.sigma() * std::sqrt(kMotion_s) / assumed_.accel_noise_density_mps2_rthz);
  // What one reading contributes to the motion, as noise of them all.
  const double root_readings = std::sqrt(static_cast<double>(segment.samples.size()));
  if (worst_gyro_radps_ > kOutlier * std::max(usual_gyro, gyro_radps_))
    out.gyro = std::max(out.gyro, worst_gyro_radps_ / root_readings / gyro_sigma);
  if (worst_accel_mps2_ > kOutlier * std::max(usual_accel, accel_mps2_))
    out.accel = std::max(out.accel, worst_accel_mps2_ / root_readings / accel_sigma);
  if (gyro_clipped_) {
    double largest = kLeastGyroError_radps;
    for (const ImuSample& s : segment.samples) largest = std::max(largest, s.gyro_radps.cwiseAbs().maxCoeff());
    out.gyro = std::max(out.gyro, largest * root_readings / gyro_sigma);
  }
  if (accel_clipped_) {
    double largest = 0;
    for (const ImuSample& s : segment.samples) largest = std::max(largest, s.accel_mps2.cwiseAbs().maxCoeff());
    out.accel = std::max(out.accel, largest * root_readings / accel_sigma);
  }
  return out;
}

}  // namespace fbvins
