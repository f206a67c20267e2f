// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_noise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fbvins/calibration/allan.hpp"
#include "fbvins/calibration/refused.hpp"
#include "fbvins/core/median.hpp"

namespace fbvins {
namespace {

constexpr double kAllanWindow_s = 1;
constexpr double kShortest_s = 20, kComfortable_s = 180;
constexpr double kMovingGyro_radps = 0.05, kMovingAccel_mps2 = 0.6;  // standard deviations within a window of what does not rest
constexpr double kTurned_radps = 0.01, kPushed_mps2 = 0.1;           // a window's mean beside that of the one before
constexpr double kShaken = 3;                                        // standard deviation within a window over a quiet one's
constexpr double kGap_s = 0.1;
constexpr double kWorstMisfit = 6;

/// A second of readings.
struct Window {
  std::size_t begin = 0, end = 0;
  Vec3 gyro = Vec3::Zero(), accel = Vec3::Zero();  ///< means
  double gyro_spread = 0, accel_spread = 0;        ///< standard deviations, of the worst axis
  bool gap = false;
};

Window window_of(const std::vector<ImuSample>& readings, std::size_t begin, std::size_t end) {
  Window w{begin, end};
  const double count = static_cast<double>(end - begin);
  Vec3 gyro2 = Vec3::Zero(), accel2 = Vec3::Zero();
  for (std::size_t i = begin; i < end; ++i) {
    w.gyro += readings[i].gyro_radps / count, w.accel += readings[i].accel_mps2 / count;
    w.gap |= i > begin && (readings[i].t - readings[i - 1].t).seconds() > kGap_s;
  }
  for (std::size_t i = begin; i < end; ++i) {
    gyro2 += (readings[i].gyro_radps - w.gyro).cwiseAbs2() / count;
    accel2 += (readings[i].accel_mps2 - w.accel).cwiseAbs2() / count;
  }
  w.gyro_spread = std::sqrt(gyro2.maxCoeff()), w.accel_spread = std::sqrt(accel2.maxCoeff());
  return w;
}

struct Rest {
  std::size_t begin = 0, end = 0;  ///< of readings
  int disturbed = 0;               ///< windows that do not rest
};

/// The spread of a quiet window: of the quietest tenth, the noisiest.
double quiet_spread(const std::vector<Window>& windows, double Window::*spread) {
  std::vector<double> all;
  for (const Window& w : windows) all.push_back(w.*spread);
  std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 10), all.end());
  return all[all.size() / 10];
}

/// The longest stretch of quiet windows whose means stay what they were.
Rest longest_rest(const std::vector<Window>& windows) {
  const double gyro_limit = std::min(kMovingGyro_radps, kShaken * quiet_spread(windows, &Window::gyro_spread));
  const double accel_limit = std::min(kMovingAccel_mps2, kShaken * quiet_spread(windows, &Window::accel_spread));
  Rest rest, now;
  const Window* before = nullptr;
  for (const Window& w : windows) {
    const bool quiet = w.gyro_spread <= gyro_limit && w.accel_spread <= accel_limit && !w.gap;
    const bool goes_on =
        quiet && before && (w.gyro - before->gyro).norm() <= kTurned_radps && (w.accel - before->accel).norm() <= kPushed_mps2;
    rest.disturbed += !quiet;
    if (quiet && !goes_on) now.begin = w.begin;
    before = quiet ? &w : nullptr;
    if (quiet) now.end = w.end;
    if (quiet && now.end - now.begin > rest.end - rest.begin) rest.begin = now.begin, rest.end = now.end;
  }
  return rest;
}

AxisNoise noise_of(const std::vector<ImuSample>& readings, const Rest& rest, double period_s, const Vec3 ImuSample::*sensor,
                   int axis) {
  std::vector<double> values;
  for (std::size_t i = rest.begin; i < rest.end; ++i) values.push_back((readings[i].*sensor)(axis));
  return fit_noise(values, period_s);
}

double worst(const std::array<AxisNoise, 3>& axes, BoundedNoise AxisNoise::*which) {
  double out = 0;
  for (const AxisNoise& axis : axes) out = std::max(out, (axis.*which).only_bounded() ? (axis.*which).high : (axis.*which).value);
  return out;
}

bool any_only_bounded(const std::array<AxisNoise, 3>& axes) {
  return std::any_of(axes.begin(), axes.end(), [](const AxisNoise& a) { return a.random_walk.only_bounded(); });
}

void warn(const Rest& rest, double missing_share, ImuNoiseResult& out) {
  const auto say = [&](std::string text) { out.warnings.push_back(std::move(text)); };
  if (rest.disturbed > 0)
    say(fmt::format("{} s of the recording are not at rest; the longest rest is used, {:.0f} s", rest.disturbed, out.duration_s));
  if (out.duration_s < kComfortable_s)
    say(fmt::format("{:.0f} s of rest are short: {:g} s and more show the white noise to some percent, hours the random walk",
                    out.duration_s, kComfortable_s));
  for (const auto& [axes, name] : {std::pair{&out.gyro, "gyroscope"}, std::pair{&out.accel, "accelerometer"}}) {
    if (any_only_bounded(*axes))
      say(fmt::format(
          "the random walk of the {}'s bias is only bounded from above by a rest of {:.0f} s; the bound is what is written", name,
          out.duration_s));
    const double misfit = std::max({(*axes)[0].misfit, (*axes)[1].misfit, (*axes)[2].misfit});
    if (misfit > kWorstMisfit)
      say(fmt::format(
          "the noise of the {} is not white noise and random walk alone ({:.0f} times the expected difference): look at the "
          "curve; the table or something on it may vibrate",
          name, misfit));
  }
  if (missing_share > 0.01) say(fmt::format("{:.1f} % of the readings are missing", 100 * missing_share));
}

}  // namespace

Result<ImuNoiseResult> measure_imu_noise(const std::vector<ImuSample>& readings) {
  if (readings.size() < 2 || readings.back().t <= readings.front().t) return refused("there are no IMU readings");
  std::vector<double> periods;
  for (std::size_t i = 0; i + 1 < readings.size(); ++i) periods.push_back((readings[i + 1].t - readings[i].t).seconds());
  const double period_s = median_of(periods), length_s = (readings.back().t - readings.front().t).seconds();
  if (!(period_s > 0)) return refused("the stamps of the IMU's readings do not grow");
  if (length_s < kShortest_s)
    return refused(
        fmt::format("{:.1f} s of readings are too short for the IMU's noise: {:g} s of rest at least, better several minutes",
                    length_s, kShortest_s));
  const auto size = static_cast<std::size_t>(std::max(4.0, std::round(kAllanWindow_s / period_s)));
  std::vector<Window> windows;
  for (std::size_t i = 0; i + size <= readings.size(); i += size) windows.push_back(window_of(readings, i, i + size));
  if (windows.empty()) return refused("there are too few IMU readings");
  const Rest rest = longest_rest(windows);
  ImuNoiseResult out;
  if (rest.end > rest.begin) {
    out.start = readings[rest.begin].t;
    out.duration_s = (readings[rest.end - 1].t - out.start).seconds();
  }
  if (out.duration_s < kShortest_s)
    return refused(fmt::format(
        "the longest rest in {:.0f} s of readings is {:.1f} s: {:g} s at least are needed, on something that does not move",
        length_s, out.duration_s, kShortest_s));
  Vec3 force = Vec3::Zero();
  for (std::size_t i = rest.begin; i < rest.end; ++i)
    force += readings[i].accel_mps2 / static_cast<double>(rest.end - rest.begin);
  if (force.norm() < 9 || force.norm() > 10.6)
    return refused(
        fmt::format("at rest the accelerometer reads {:.2f} m/s^2 instead of 9.8: its unit or scale is wrong", force.norm()));
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    out.gyro[k] = noise_of(readings, rest, period_s, &ImuSample::gyro_radps, axis);
    out.accel[k] = noise_of(readings, rest, period_s, &ImuSample::accel_mps2, axis);
  }
  out.noise.gyro_noise_density_radps_rthz = worst(out.gyro, &AxisNoise::density);
  out.noise.accel_noise_density_mps2_rthz = worst(out.accel, &AxisNoise::density);
  out.noise.gyro_random_walk_radps2_rthz = worst(out.gyro, &AxisNoise::random_walk);
  out.noise.accel_random_walk_mps3_rthz = worst(out.accel, &AxisNoise::random_walk);
  out.noise.rate_hz = 1 / period_s;
  warn(rest, 1 - static_cast<double>(rest.end - rest.begin) * period_s / (out.duration_s + period_s), out);
  return out;
}

std::string imu_noise_to_kalibr(const ImuNoiseResult& result, const std::string& topic) {
  const auto line = [](const char* field, double value, const std::array<AxisNoise, 3>& axes, BoundedNoise AxisNoise::*which,
                       const char* unit) {
    std::string text = fmt::format("{}: {:.4g}  # {}; by axis", field, value, unit);
    for (const AxisNoise& axis : axes) {
      const BoundedNoise& n = axis.*which;
      text +=
          n.only_bounded() ? fmt::format(" < {:.2g}", n.high) : fmt::format(" {:.3g} ({:.2g} to {:.2g})", n.value, n.low, n.high);
    }
    return text + "\n";
  };
  std::string text = fmt::format("# from {:.0f} s of rest; bounds are those of 95 %\n", result.duration_s);
  for (const std::string& warning : result.warnings) text += fmt::format("# {}\n", warning);
  text += line("accelerometer_noise_density", result.noise.accel_noise_density_mps2_rthz, result.accel, &AxisNoise::density,
               "m/s^2/sqrt(Hz)");
  text += line("accelerometer_random_walk", result.noise.accel_random_walk_mps3_rthz, result.accel, &AxisNoise::random_walk,
               "m/s^3/sqrt(Hz)");
  text += line("gyroscope_noise_density", result.noise.gyro_noise_density_radps_rthz, result.gyro, &AxisNoise::density,
               "rad/s/sqrt(Hz)");
  text += line("gyroscope_random_walk", result.noise.gyro_random_walk_radps2_rthz, result.gyro, &AxisNoise::random_walk,
               "rad/s^2/sqrt(Hz)");
  return text + fmt::format("rostopic: {}\nupdate_rate: {:.1f}\n", topic, result.noise.rate_hz);
}

}  // namespace fbvins
