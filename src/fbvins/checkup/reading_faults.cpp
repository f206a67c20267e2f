// SPDX-License-Identifier: Apache-2.0
#include "fbvins/checkup/reading_faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace fbvins {
namespace {

/// An axis that stays for so long is stuck. The longest that one of a sound sensor keeps its last bit in our recordings is 65 ms
/// (13 readings of a handheld rig at rest, at 200 Hz); a gyroscope that reads 0 below a threshold does longer, but not on a
/// vehicle that moves.
constexpr double kStuck_s = 2;
/// Steps of its resolution that another axis of the sensor has meanwhile moved by: of these data sheets give 1 to 2 % of one axis
/// in another, and the mounting is as exact, so that a sound axis moves by a step at least.
constexpr double kOtherMoves_steps = 100;
/// So few values, where another axis has so many, are a constant with bits that flip.
constexpr std::size_t kFewValues = 3, kManyValues = 300;

/// A spike is farther from both neighbours, to the same side, than this. A vehicle that turned so would have an angular
/// acceleration of 200 rad/s^2 and its opposite within two readings at 200 Hz; in our recordings a reading is at most 0.24 rad/s
/// and 7.9 m/s^2 away (the rotors of EuRoC's V1_02).
constexpr double kSpike_radps = 1, kSpike_mps2 = 15;
/// And so many times as far as any other of the readings around it: vibration makes each as bad. About four times at most in our
/// recordings, from the neighbours that count. And farther than any of those around is from 0: in degrees or thousandths of g all
/// readings are large.
constexpr double kAlone = 6;
constexpr std::size_t kAround = 10;
/// One or two are shocks: a landing, a hit on the frame.
constexpr std::size_t kFewestSpikes = 3;

const Vec3& vector_of(const ImuSample& sample, bool gyro) { return gyro ? sample.gyro_radps : sample.accel_mps2; }

using Axes = std::array<std::vector<double>, 3>;

Axes axes_of(std::span<const ImuSample> samples, bool gyro) {
  Axes axes;
  for (std::size_t i = 0; i < 3; ++i)
    for (const ImuSample& sample : samples) axes[i].push_back(vector_of(sample, gyro)(static_cast<Eigen::Index>(i)));
  return axes;
}

bool is_constant(const std::vector<double>& values) {
  return std::ranges::all_of(values, [&](double value) { return value == values.front(); });
}

std::size_t distinct(std::vector<double> values) {
  std::ranges::sort(values);
  return static_cast<std::size_t>(std::ranges::unique(values).begin() - values.begin());
}

/// How many steps of its resolution, the smallest that it makes, an axis moves by.
double steps_moved(std::span<const double> values) {
  double step = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < values.size(); ++i)
    if (values[i] != values[i - 1]) step = std::min(step, std::abs(values[i] - values[i - 1]));
  const auto [low, high] = std::ranges::minmax(values);
  return (high - low) / step;
}

struct Run {
  std::size_t begin = 0, end = 0;  ///< readings that are the same
};

/// The longest in time.
Run longest_run(std::span<const double> values, std::span<const ImuSample> samples) {
  Run longest;
  double longest_s = -1;
  for (std::size_t begin = 0, end = 0; begin < values.size(); begin = end) {
    for (end = begin + 1; end < values.size() && values[end] == values[begin];) ++end;
    const double s = (samples[end - 1].t - samples[begin].t).seconds();
    if (s > longest_s) longest_s = s, longest = {begin, end};
  }
  return longest;
}

bool moves(const Axes& axes, const Run& run) {
  return std::ranges::any_of(axes, [&](const std::vector<double>& values) {
    return steps_moved(std::span(values).subspan(run.begin, run.end - run.begin)) >= kOtherMoves_steps;
  });
}

Finding stuck_finding(const std::string& what, const std::string& how, double seconds) {
  Finding finding;
  finding.kind = FindingKind::imu_stuck;
  finding.size = seconds, finding.unit = "s";
  finding.measured = fmt::format("{} reads {}", what, how);
  finding.expected = "each axis changes while the vehicle moves, by its noise alone";
  finding.advice =
      "look for a column that the driver does not fill, a broken sensor, or a setting that switches the axis off, and record again: no calibration corrects it";
  return finding;
}

/// How far a value lies from both neighbours, where it lies to the same side of both; 0 elsewhere.
double stands_out(std::span<const double> values, std::size_t i) {
  const double before = values[i] - values[i - 1], after = values[i] - values[i + 1];
  return before * after > 0 ? std::min(std::abs(before), std::abs(after)) : 0;
}

bool is_alone(std::span<const double> values, std::size_t i, double out) {
  const std::size_t begin = std::max<std::size_t>(i, kAround + 1) - kAround, end = std::min(i + kAround + 1, values.size() - 1);
  for (std::size_t k = begin; k < end; ++k) {
    if (k != i && std::abs(values[k]) > out) return false;
    if ((k + 1 < i || k > i + 1) && kAlone * stands_out(values, k) > out) return false;
  }
  return true;
}

}  // namespace

std::optional<Finding> check_stuck(std::span<const ImuSample> samples, bool gyro) {
  if (samples.size() < 2) return std::nullopt;
  const auto axes = axes_of(samples, gyro);
  const double all_s = (samples.back().t - samples.front().t).seconds();
  const std::string sensor = gyro ? "the gyroscope" : "the accelerometer";
  if (all_s >= kStuck_s && std::ranges::all_of(axes, is_constant) && moves(axes_of(samples, !gyro), {0, samples.size()}))
    return stuck_finding(sensor, fmt::format("a constant ({:.6g}, {:.6g}, {:.6g})", axes[0][0], axes[1][0], axes[2][0]), all_s);
  const std::size_t most = std::max({distinct(axes[0]), distinct(axes[1]), distinct(axes[2])});
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string axis = fmt::format("axis {} of {}", "xyz"[i], sensor);
    const Run run = longest_run(axes[i], samples);
    const double held_s = (samples[run.end - 1].t - samples[run.begin].t).seconds();
    if (held_s >= kStuck_s && moves(axes, run)) {
      const bool always = run.end - run.begin == samples.size();
      const std::string when = always ? "" : fmt::format(" for {:.1f} s after {} ns", held_s, samples[run.begin].t.ns);
      return stuck_finding(axis, fmt::format("a constant {:.6g}{}", axes[i][run.begin], when), held_s);
    }
    const std::size_t own = distinct(axes[i]);
    if (all_s >= kStuck_s && own > 1 && own <= kFewValues && most >= kManyValues)
      return stuck_finding(axis, fmt::format("{} values in all, another axis {}", own, most), all_s);
  }
  return std::nullopt;
}

Spikes find_spikes(std::span<const ImuSample> samples) {
  Spikes spikes;
  if (samples.size() < 3) return spikes;
  spikes.seconds = (samples.back().t - samples.front().t).seconds();
  std::vector<char> is_spike(samples.size(), 0);
  for (const bool gyro : {true, false}) {
    std::vector<char> of_sensor(samples.size(), 0);
    double& largest = gyro ? spikes.largest_radps : spikes.largest_mps2;
    for (const std::vector<double>& values : axes_of(samples, gyro))
      for (std::size_t i = 1; i + 1 < values.size(); ++i) {
        const double out = stands_out(values, i);
        if (out < (gyro ? kSpike_radps : kSpike_mps2) || !is_alone(values, i, out)) continue;
        of_sensor[i] = is_spike[i] = 1;
        largest = std::max(largest, out);
      }
    (gyro ? spikes.gyro : spikes.accel) = static_cast<int>(std::ranges::count(of_sensor, 1));
  }
  for (std::size_t i = 0; i < is_spike.size(); ++i)
    if (is_spike[i] != 0) spikes.at.push_back(i);
  return spikes.at.size() < kFewestSpikes ? Spikes{} : spikes;
}

std::optional<Finding> check_spikes(const Spikes& spikes) {
  if (spikes.at.empty()) return std::nullopt;
  Finding finding;
  finding.kind = FindingKind::imu_spikes;
  finding.size = static_cast<double>(spikes.at.size()), finding.unit = "readings";
  finding.measured = fmt::format("{} readings in {:.0f} s lie far from those before and after them: {} of the gyroscope",
                                 spikes.at.size(), spikes.seconds, spikes.gyro);
  if (spikes.gyro > 0) finding.measured += fmt::format(" (by up to {:.2g} rad/s)", spikes.largest_radps);
  finding.measured += fmt::format(", {} of the accelerometer", spikes.accel);
  if (spikes.accel > 0) finding.measured += fmt::format(" (by up to {:.2g} m/s^2)", spikes.largest_mps2);
  finding.expected = "no vehicle moves so for a single reading";
  finding.advice =
      "look for errors on the bus (a check sum, a slower clock, a shorter cable) and for bytes that are read while they change; the rest is judged without these readings";
  return finding;
}

std::vector<Finding> check_readings(std::span<const ImuSample> samples) {
  std::vector<Finding> findings;
  for (const bool gyro : {true, false})
    if (auto finding = check_stuck(samples, gyro)) findings.push_back(*std::move(finding));
  if (auto finding = check_spikes(find_spikes(samples))) findings.push_back(*std::move(finding));
  return findings;
}

std::vector<ImuSample> without(const Spikes& spikes, std::span<const ImuSample> samples) {
  std::vector<ImuSample> out(samples.begin(), samples.end());
  for (std::size_t first = 0, last = 0; first < spikes.at.size(); first = last + 1) {
    for (last = first; last + 1 < spikes.at.size() && spikes.at[last + 1] == spikes.at[last] + 1;) ++last;
    const ImuSample &before = samples[spikes.at[first] - 1], &after = samples[spikes.at[last] + 1];
    const double whole_s = std::max((after.t - before.t).seconds(), 1e-9);
    for (std::size_t i = spikes.at[first]; i <= spikes.at[last]; ++i) {
      const double part = (samples[i].t - before.t).seconds() / whole_s;
      out[i].gyro_radps = (1 - part) * before.gyro_radps + part * after.gyro_radps;
      out[i].accel_mps2 = (1 - part) * before.accel_mps2 + part * after.accel_mps2;
    }
  }
  return out;
}

}  // namespace fbvins
