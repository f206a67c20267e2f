// SPDX-License-Identifier: Apache-2.0
#include "fbvins/checkup/reading_units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "fbvins/core/median.hpp"
#include "fbvins/imu/nav_state.hpp"

namespace fbvins {
namespace {

constexpr double kPart_s = 0.5;
constexpr std::size_t kFewestParts = 4;
/// Gravity may differ by this share: 3 % of an accelerometer's scale, a bias of 0.5 m/s^2, a second of climbing.
constexpr double kGravityTolerance = 0.15;
/// Less than this share of gravity is none.
constexpr double kNoGravity = 0.3;
/// Half of all readings turn faster than this: no vehicle that a camera could follow.
constexpr double kSpinning_radps = 6;

/// Units in which gravity is this nearly the same cannot be distinguished by it: a bias alone makes up for the difference.
constexpr double kSameUnit = 0.05;

struct Unit {
  double gravity;  ///< in this unit
  const char* name;
  const char* factor;  ///< to m/s^2
};
constexpr Unit kUnits[] = {
    {1.0, "g", "9.80665"},         {1000.0, "thousandths of g", "0.00980665"},
    {9807.0, "mm/s^2", "0.001"},   {980.7, "cm/s^2", "0.01"},
    {32.17, "feet/s^2", "0.3048"},
};

bool near_to(double value, double wanted) { return std::abs(value / wanted - 1) < kGravityTolerance; }

/// What to do about readings in another unit; empty where gravity is near that of none.
std::string advice_on_unit(double norm) {
  const auto ratio = [&](const Unit& unit) { return std::abs(std::log(norm / unit.gravity)); };
  const Unit& nearest =
      *std::min_element(std::begin(kUnits), std::end(kUnits), [&](const Unit& a, const Unit& b) { return ratio(a) < ratio(b); });
  if (!near_to(norm, nearest.gravity)) return {};
  for (const Unit& other : kUnits)
    if (&other != &nearest && std::abs(other.gravity / nearest.gravity - 1) < kSameUnit)
      return fmt::format(
          "it looks like {} or {}, too close to each other to be distinguished: multiply the accelerometer's readings "
          "by {} or {}, as the sensor's data sheet says",
          nearest.name, other.name, nearest.factor, other.factor);
  return fmt::format("it looks like {}: multiply the accelerometer's readings by {}", nearest.name, nearest.factor);
}

void check_accelerometer(std::span<const ImuSample> samples, std::vector<Finding>& findings) {
  const GravitySeen seen = gravity_seen(samples);
  if (seen.sigma_mps2 == 0 || near_to(seen.norm_mps2, kGravity_mps2)) return;
  Finding finding;
  finding.kind = FindingKind::accel_units;
  finding.size = seen.norm_mps2 / kGravity_mps2, finding.sigma = seen.sigma_mps2 / kGravity_mps2;
  finding.unit = "of gravity";
  finding.measured = fmt::format("the accelerometer's mean reading is {:.4g} +- {:.2g}", seen.norm_mps2, seen.sigma_mps2);
  finding.expected = "gravity alone is 9.81 m/s^2";
  finding.advice = seen.norm_mps2 < kNoGravity * kGravity_mps2
                       ? "gravity seems to have been taken out: give the readings as the sensor has them"
                       : "find out the unit of the readings, and give m/s^2";
  if (std::string unit = advice_on_unit(seen.norm_mps2); !unit.empty()) finding.advice = std::move(unit);
  findings.push_back(std::move(finding));
}

/// Whether gyroscope and accelerometer are. A gyroscope in degrees a second may read 9.8 on average, too, but beside an
/// accelerometer in g that reads a steady one.
bool exchanged(std::span<const ImuSample> samples) {
  std::vector<ImuSample> other(samples.begin(), samples.end());
  for (ImuSample& sample : other) std::swap(sample.gyro_radps, sample.accel_mps2);
  const GravitySeen seen = gravity_seen(samples), there = gravity_seen(other);
  const bool in_g = std::abs(seen.norm_mps2 - 1) < kSameUnit && seen.sigma_mps2 < kSameUnit;
  return !in_g && there.sigma_mps2 > 0 && near_to(there.norm_mps2, kGravity_mps2) && seen.norm_mps2 < kNoGravity * kGravity_mps2;
}

Finding exchanged_finding() {
  Finding finding;
  finding.kind = FindingKind::accel_units;
  finding.unit = "of gravity";
  finding.measured = "the gyroscope's mean reading is gravity's 9.8, and the accelerometer's is near zero";
  finding.expected = "the accelerometer measures gravity";
  finding.advice = "gyroscope and accelerometer are exchanged: exchange them";
  return finding;
}

void check_gyroscope(std::span<const ImuSample> samples, std::vector<Finding>& findings) {
  std::vector<double> rates;
  rates.reserve(samples.size());
  for (const ImuSample& sample : samples) rates.push_back(sample.gyro_radps.norm());
  const double typical = median(rates);
  if (typical < kSpinning_radps) return;
  Finding finding;
  finding.kind = FindingKind::gyro_units;
  finding.size = 180 / std::numbers::pi;
  finding.unit = "times too large";
  finding.measured = fmt::format("half of the gyroscope's readings are above {:.1f}", typical);
  finding.expected = fmt::format("nothing that a camera follows turns by {} rad/s for long", kSpinning_radps);
  finding.advice = "it looks like degrees: multiply the gyroscope's readings by pi / 180";
  findings.push_back(std::move(finding));
}

}  // namespace

GravitySeen gravity_seen(std::span<const ImuSample> samples) {
  std::vector<double> norms;
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (std::size_t i = 0, first = 0; i < samples.size(); ++i) {
    sum += samples[i].accel_mps2;
    ++count;
    if ((samples[i].t - samples[first].t).seconds() < kPart_s) continue;
    norms.push_back((sum / count).norm());
    sum.setZero();
    count = 0;
    first = i;
  }
  if (norms.size() < kFewestParts) return {};
  const double typical = median(norms);
  std::vector<double> off;
  for (const double norm : norms) off.push_back(std::abs(norm - typical));
  return {typical, std::max(1.48 * median(off) / std::sqrt(static_cast<double>(norms.size())), 1e-9)};
}

std::vector<Finding> check_reading_units(std::span<const ImuSample> samples) {
  std::vector<Finding> findings;
  if (samples.size() < 2 || (samples.back().t - samples.front().t).seconds() < kFewestParts * kPart_s) return findings;
  if (exchanged(samples)) return {exchanged_finding()};
  check_accelerometer(samples, findings);
  check_gyroscope(samples, findings);
  return findings;
}

}  // namespace fbvins
