// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/imu_health.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

namespace fbvins {
namespace {

/// A saturated axis repeats its extreme value for several readings, several times; a smooth motion's peak does so once at most.
constexpr int kFewestRuns = 2, kRunLength = 3;
/// A signal that spans fewer steps of its resolution than this repeats values anyway.
constexpr double kFewestSteps = 50;
/// Half of gravity; beyond, aliasing and rectification shift the bias of accelerometers of this class.
constexpr double kMostVibration_mps2 = 5;
constexpr int kBlock = 512;

/// How many readings of an axis are in runs at its largest value (of sign times the readings); 0 where runs are few.
int clipped(std::span<const double> values, double sign) {
  double high = -1e300, low = 1e300, step = 1e300;
  for (std::size_t i = 0; i < values.size(); ++i) {
    high = std::max(high, sign * values[i]), low = std::min(low, sign * values[i]);
    if (i > 0 && values[i] != values[i - 1]) step = std::min(step, std::abs(values[i] - values[i - 1]));
  }
  if (high - low < kFewestSteps * step) return 0;
  int runs = 0, count = 0, length = 0;
  for (std::size_t i = 0; i <= values.size(); ++i) {
    if (i < values.size() && sign * values[i] == high) {
      ++length;
      continue;
    }
    if (length >= kRunLength) ++runs, count += length;
    length = 0;
  }
  return runs >= kFewestRuns ? count : 0;
}

int clipped(std::span<const ImuSample> samples, bool gyro) {
  int count = 0;
  std::vector<double> values(samples.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < samples.size(); ++i) values[i] = gyro ? samples[i].gyro_radps(axis) : samples[i].accel_mps2(axis);
    count += clipped(values, 1) + clipped(values, -1);
  }
  return count;
}

double rate_of(std::span<const ImuSample> samples) {
  if (samples.size() < 2) return 0;
  return static_cast<double>(samples.size() - 1) / std::max((samples.back().t - samples.front().t).seconds(), 1e-9);
}

}  // namespace

std::optional<Finding> check_saturation(std::span<const ImuSample> samples) {
  const int gyro = clipped(samples, true), accel = clipped(samples, false);
  if (gyro + accel == 0) return std::nullopt;
  Finding finding;
  finding.kind = FindingKind::saturation;
  finding.size = gyro + accel, finding.unit = "readings";
  finding.measured =
      fmt::format("{} readings of the gyroscope and {} of the accelerometer are at the end of their range", gyro, accel);
  finding.expected = "none";
  finding.advice = "set the IMU to a larger range, or mount it more softly";
  return finding;
}

double cut_off_share_of_gyro(std::span<const ImuSample> samples) {
  return samples.empty() ? 0 : clipped(samples, true) / static_cast<double>(samples.size());
}

Vibration measure_vibration(std::span<const ImuSample> samples) {
  Vibration out;
  const double rate = rate_of(samples);
  if (rate < 80 || samples.size() < kBlock) return out;
  std::vector<double> power(kBlock / 2, 0.0);
  const std::size_t blocks = samples.size() / kBlock;
  const std::size_t step = std::max<std::size_t>(blocks / 24, 1);
  int used = 0;
  for (std::size_t block = 0; block < blocks; block += step, ++used)
    for (int axis = 0; axis < 3; ++axis)
      for (int k = 1; k < kBlock / 2; ++k) {
        if (k * rate / kBlock < kVibrationFrom_hz) continue;
        const std::complex<double> turn = std::polar(1.0, -2 * std::numbers::pi * k / kBlock);
        std::complex<double> sum = 0, at = 1;
        for (std::size_t i = 0; i < kBlock; ++i, at *= turn) {
          const double window = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / kBlock);
          sum += window * samples[block * kBlock + i].accel_mps2(axis) * at;
        }
        power[static_cast<std::size_t>(k)] += std::norm(sum);
      }
  double total = 0;
  std::size_t peak = 0;
  for (std::size_t k = 0; k < power.size(); ++k) {
    total += power[k];
    if (power[k] > power[peak]) peak = k;
  }
  if (used == 0 || !(total > 0)) return out;
  // Factor 2 for the negative frequencies; the Hann window keeps 3/8 of the power.
  out.rms_mps2 = std::sqrt(2 * total / used / (0.375 * kBlock * kBlock));
  out.peak_hz = static_cast<double>(peak) * rate / kBlock;
  const std::size_t reach = std::max<std::size_t>(peak / 20, 1);
  for (std::size_t k = peak - std::min(peak, reach); k < std::min(power.size(), peak + reach + 1); ++k)
    out.peak_share += power[k] / total;
  return out;
}

std::optional<Finding> check_vibration(std::span<const ImuSample> samples) {
  const Vibration seen = measure_vibration(samples);
  if (seen.rms_mps2 < kMostVibration_mps2) return std::nullopt;
  Finding finding;
  finding.kind = FindingKind::vibration;
  finding.size = seen.rms_mps2, finding.unit = "m/s^2";
  finding.sigma = seen.rms_mps2 / std::sqrt(static_cast<double>(samples.size()) / 10);
  finding.measured = fmt::format(
      "above {:.0f} Hz the accelerometer vibrates by {:.1f} +- {:.1f} m/s^2 (root mean square), {:.0f} % of it near {:.0f} Hz",
      kVibrationFrom_hz, finding.size, finding.sigma, 100 * seen.peak_share, seen.peak_hz);
  finding.expected = fmt::format("at most {:.0f} m/s^2", kMostVibration_mps2);
  finding.advice = "balance the propellers, mount the IMU softly, and switch on its low-pass filter";
  return finding;
}

}  // namespace fbvins
