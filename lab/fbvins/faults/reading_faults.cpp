// SPDX-License-Identifier: Apache-2.0
#include "fbvins/faults/reading_faults.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "fbvins/core/angle.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace {

constexpr double kGyroForAccel = 0.06;      ///< rad/s of turning noise that comes with 1 m/s^2
constexpr double kGyroSpikeForAccel = 0.1;  ///< likewise of spikes
constexpr std::uint32_t kReadingsForSpike = 50;
constexpr int kRepeats = 4;

Vec3 random_direction(Rng& rng) {
  const double z = rng.normal(), y = rng.normal();
  return Vec3(rng.normal(), y, z).normalized();
}

Vec3 normal3(Rng& rng) { return {rng.normal(), rng.normal(), rng.normal()}; }

}  // namespace

ReadingFaultInjector::ReadingFaultInjector(ReadingFault fault, double amount, std::uint64_t seed)
    : fault_(fault), amount_(amount), rng_(seed, 11), axis_(static_cast<int>(rng_.below(3))), direction_(random_direction(rng_)) {
  for (Tone& tone : tones_)
    tone = {rng_.uniform(80, 200), rng_.uniform(0, 2 * std::numbers::pi), random_direction(rng_), random_direction(rng_)};
}

void ReadingFaultInjector::alter(ImuSample& sample) {
  if (!first_) first_ = sample;
  const double since_s = (sample.t - first_->t).seconds();
  Vec3 &gyro = sample.gyro_radps, &accel = sample.accel_mps2;
  switch (fault_) {
    case ReadingFault::frozen: gyro = first_->gyro_radps, accel = first_->accel_mps2; break;
    case ReadingFault::every_fourth:
      if (count_++ % kRepeats == 0) held_ = sample;
      gyro = held_->gyro_radps, accel = held_->accel_mps2;
      break;
    case ReadingFault::zero: gyro.setZero(), accel.setZero(); break;
    case ReadingFault::nan: gyro.setConstant(std::numeric_limits<double>::quiet_NaN()); break;
    case ReadingFault::noise:
      accel += amount_ * normal3(rng_);
      gyro += kGyroForAccel * amount_ * normal3(rng_);
      break;
    case ReadingFault::vibration:
      for (const Tone& tone : tones_) {  // two of rms 1 / sqrt(2) each
        const double wave = amount_ * std::sin(2 * std::numbers::pi * tone.frequency_hz * since_s + tone.phase);
        accel += wave * tone.accel;
        gyro += kGyroForAccel * wave * tone.gyro;
      }
      break;
    case ReadingFault::spikes:
      if (rng_.below(kReadingsForSpike) == 0) {
        accel += amount_ * random_direction(rng_);
        gyro += kGyroSpikeForAccel * amount_ * random_direction(rng_);
      }
      break;
    case ReadingFault::gyro_clipped: gyro = gyro.cwiseMax(-amount_).cwiseMin(amount_); break;
    case ReadingFault::accel_clipped: accel = accel.cwiseMax(-amount_).cwiseMin(amount_); break;
    case ReadingFault::gyro_bias: gyro(axis_) += amount_; break;
    case ReadingFault::accel_bias: accel(axis_) += amount_; break;
    case ReadingFault::gyro_drift: gyro(axis_) += amount_ * since_s; break;
    case ReadingFault::gyro_scale: gyro *= 1 + amount_ / 100; break;
    case ReadingFault::accel_scale: accel *= 1 + amount_ / 100; break;
    case ReadingFault::gyro_axis_dead: gyro(axis_) = first_->gyro_radps(axis_); break;
    case ReadingFault::accel_axis_dead: accel(axis_) = first_->accel_mps2(axis_); break;
    case ReadingFault::gyro_flipped: gyro(axis_) = -gyro(axis_); break;
    case ReadingFault::axes_exchanged: std::swap(gyro.x(), gyro.y()), std::swap(accel.x(), accel.y()); break;
    case ReadingFault::loose: {
      const Quat turn = so3_exp(amount_ * kDegree * direction_);
      gyro = turn * gyro, accel = turn * accel;
      break;
    }
  }
}

}  // namespace fbvins
