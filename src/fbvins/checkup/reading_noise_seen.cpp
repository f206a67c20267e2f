// SPDX-License-Identifier: Apache-2.0
#include "fbvins/checkup/reading_noise_seen.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "fbvins/core/median.hpp"

namespace fbvins {
namespace {

constexpr double kWindow_s = 0.5, kShortest_s = 3;
constexpr std::size_t kFewestAtRest = 3;
/// Variance of third differences of white noise over that of the noise: 1 + 9 + 9 + 1. Motion is smoother.
constexpr double kThirdDifference = 20;
/// At rest the whole of a window is as its noise is: no slow motion of this many times its standard deviation.
constexpr double kRestSpread = 1.6;
/// And no rotor turns: accelerometers have less than half of this, m/s^2/sqrt(Hz), rotors more than twice of it.
constexpr double kWithoutRotors = 0.01;
/// Declared over seen from which a figure is wrong, either way. What a calibration allows for on purpose is less.
constexpr double kTooLarge = 10, kTooSmall = 1.0 / 5;
/// Data sheets and a quiet table show less than a flight: what is written allows for it (docs/calibration.md).
constexpr double kAllowance = 2;

struct WindowNoise {
  Densities white, all;
};

/// Of each axis alike; readings that move in steps have at least the noise of rounding.
WindowNoise noise_of(std::span<const ImuSample> s, double rate_hz) {
  double white[2] = {}, all[2] = {};
  for (int sensor = 0; sensor < 2; ++sensor)
    for (int axis = 0; axis < 3; ++axis) {
      const auto value = [&](std::size_t i) { return sensor == 0 ? s[i].gyro_radps(axis) : s[i].accel_mps2(axis); };
      double square = 0, sum = 0, sum2 = 0;
      for (std::size_t i = 0; i < s.size(); ++i) {
        sum += value(i), sum2 += value(i) * value(i);
        if (i >= 3) square += std::pow(value(i) - 3 * value(i - 1) + 3 * value(i - 2) - value(i - 3), 2);
      }
      const auto n = static_cast<double>(s.size());
      white[sensor] += square / (3 * kThirdDifference * (n - 3));
      all[sensor] += std::max(0.0, sum2 / n - sum / n * (sum / n)) / 3;
    }
  const double root_rate = std::sqrt(rate_hz);
  return {{std::sqrt(white[0]) / root_rate, std::sqrt(white[1]) / root_rate},
          {std::sqrt(all[0]) / root_rate, std::sqrt(all[1]) / root_rate}};
}

Densities median_of(const std::vector<Densities>& windows) {
  std::vector<double> gyro, accel;
  for (const Densities& one : windows) gyro.push_back(one.gyro_radps_rthz), accel.push_back(one.accel_mps2_rthz);
  return {median(gyro), median(accel)};
}

}  // namespace

std::optional<ReadingNoiseSeen> reading_noise_seen(std::span<const ImuSample> samples) {
  if (samples.size() < 4 || !((samples.back().t - samples.front().t).seconds() >= kShortest_s)) return std::nullopt;
  const double rate_hz = static_cast<double>(samples.size() - 1) / (samples.back().t - samples.front().t).seconds();
  const auto size = static_cast<std::size_t>(std::max(12.0, kWindow_s * rate_hz));
  ReadingNoiseSeen seen;
  std::vector<Densities> rest;
  for (std::size_t first = 0; first + size <= samples.size(); first += size) {
    const auto [white, all] = noise_of(samples.subspan(first, size), rate_hz);
    if (!(white.gyro_radps_rthz > 0) || !(white.accel_mps2_rthz > 0)) continue;  // readings that repeat
    const auto less = [](double& least, double value) { least = least == 0 ? value : std::min(least, value); };
    less(seen.quietest.gyro_radps_rthz, white.gyro_radps_rthz), less(seen.quietest.accel_mps2_rthz, white.accel_mps2_rthz);
    if (white.accel_mps2_rthz < kWithoutRotors && all.gyro_radps_rthz < kRestSpread * white.gyro_radps_rthz &&
        all.accel_mps2_rthz < kRestSpread * white.accel_mps2_rthz)
      rest.push_back(white);
  }
  if (seen.quietest.gyro_radps_rthz == 0) return std::nullopt;
  if (rest.size() >= kFewestAtRest) seen.at_rest = median_of(rest);
  return seen;
}

std::optional<Finding> check_declared_noise(std::span<const ImuSample> samples, const ImuNoise& declared, ImuNoise& write) {
  const auto seen = reading_noise_seen(samples);
  if (!seen) return std::nullopt;
  Finding finding;
  finding.kind = FindingKind::imu_noise, finding.unit = kOfReadings;
  const auto judge = [&](const char* sensor, double said, double quietest, double at_rest, double& written) {
    const bool large = said > kTooLarge * quietest, small = at_rest > 0 && said < kTooSmall * at_rest;
    if (!large && !small) return;
    const double shown = large ? quietest : at_rest;
    if (finding.measured.empty()) finding.size = said / shown;
    finding.measured += fmt::format("{}the {}'s noise density in the calibration is {:.3g}, and the readings show {}{:.2g}",
                                    finding.measured.empty() ? "" : ", ", sensor, said, large ? "at most " : "at rest ", shown);
    written = kAllowance * shown;
  };
  const Densities rest = seen->at_rest.value_or(Densities{});
  judge("gyroscope", declared.gyro_noise_density_radps_rthz, seen->quietest.gyro_radps_rthz, rest.gyro_radps_rthz,
        write.gyro_noise_density_radps_rthz);
  judge("accelerometer", declared.accel_noise_density_mps2_rthz, seen->quietest.accel_mps2_rthz, rest.accel_mps2_rthz,
        write.accel_noise_density_mps2_rthz);
  if (finding.measured.empty()) return std::nullopt;
  finding.expected = "a fifth to ten times what the readings show, rad/s/sqrt(Hz) and m/s^2/sqrt(Hz)";
  finding.advice = fmt::format("write {:.2g} and {:.2g}, or measure them (fbvins calibrate --imu-noise)",
                               write.gyro_noise_density_radps_rthz, write.accel_noise_density_mps2_rthz);
  finding.fields = {CalibrationField::imu_noise};
  return finding;
}

}  // namespace fbvins
