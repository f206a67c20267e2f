// SPDX-License-Identifier: Apache-2.0
#include "fbvins/checkup/stamps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fbvins/core/median.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kFewestStamps = 20;
/// Relative to the rate of the calibration.
constexpr double kRateTolerance = 0.1;
/// Share of readings that repeat the one before to the last bit: a sensor's noise does not.
constexpr double kMostRepeated = 0.1;
/// Root mean square deviation of the images' stamps from regular ones. Stamps of triggered cameras are a hundred times
/// better.
constexpr double kMostIrregular_s = 2e-3;

double typical_step_s(std::vector<double> steps) { return median(steps); }

void check_readings(std::span<const ImuSample> samples, const StereoRig& rig, std::vector<Finding>& findings) {
  std::vector<double> steps;
  int repeated = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    steps.push_back((samples[i].t - samples[i - 1].t).seconds());
    repeated += samples[i].gyro_radps == samples[i - 1].gyro_radps && samples[i].accel_mps2 == samples[i - 1].accel_mps2;
  }
  const double rate = 1 / std::max(typical_step_s(steps), 1e-9), said = rig.imu_noise.rate_hz;
  Finding finding;
  finding.kind = FindingKind::imu_stamps;
  if (std::abs(rate / said - 1) > kRateTolerance) {
    finding.size = rate, finding.unit = "Hz";
    finding.measured = fmt::format("the IMU gives {:.1f} readings a second", rate);
    finding.expected = fmt::format("the calibration says {:.1f}", said);
    finding.advice = "correct the rate, on which the covariance rests";
    finding.corrected = fmt::format("rate_hz: {:.0f}", rate);
    findings.push_back(finding);
  }
  const double share = repeated / static_cast<double>(steps.size());
  if (share > kMostRepeated) {
    finding.size = share, finding.unit = "of the readings", finding.corrected.clear();
    finding.measured = fmt::format("{:.0f} % of the IMU's readings repeat the one before to the last bit", 100 * share);
    finding.expected = "noise alone makes each different";
    finding.advice = "the driver repeats readings or the IMU hangs: hand on each reading once, at the sensor's own rate";
    findings.push_back(finding);
  }
}

void check_images(std::span<const Time> images, std::vector<Finding>& findings) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < images.size(); ++i) steps.push_back((images[i] - images[i - 1]).seconds());
  const double period = typical_step_s(steps);
  if (!(period > 0)) return;
  double sum = 0;
  int regular = 0;
  for (const double step : steps) {
    const double periods = std::max(std::round(step / period), 1.0);
    if (periods > 4) continue;  // a pause
    sum += std::pow(step - periods * period, 2);
    ++regular;
  }
  const double irregular = std::sqrt(sum / std::max(regular, 1) / 2);
  if (irregular < kMostIrregular_s) return;
  Finding finding;
  finding.kind = FindingKind::image_stamps;
  finding.size = 1e3 * irregular, finding.sigma = finding.size / std::sqrt(2.0 * std::max(regular, 1)), finding.unit = "ms";
  finding.measured = fmt::format("the images' stamps are {:.1f} +- {:.1f} ms off regular intervals (root mean square)",
                                 finding.size, finding.sigma);
  finding.expected = "a camera exposes at regular times, known to a tenth of a millisecond";
  finding.advice = "stamp images by the camera's own clock or its trigger, not on arrival";
  findings.push_back(std::move(finding));
}

void check_clocks(std::span<const ImuSample> samples, std::span<const Time> images, const StereoRig& rig,
                  std::vector<Finding>& findings) {
  const Duration offset = Duration::from_seconds(rig.time_offset_s);
  const auto covered = std::count_if(images.begin(), images.end(),
                                     [&](Time t) { return t + offset >= samples.front().t && t + offset <= samples.back().t; });
  if (2 * static_cast<std::size_t>(covered) >= images.size()) return;
  Finding finding;
  finding.kind = FindingKind::clocks_apart;
  finding.size = (samples.front().t - images.front()).seconds(), finding.unit = "s";
  finding.measured = fmt::format(
      "{} of {} images are at times at which there are IMU readings; the first reading is stamped {:.3f} s after the first image",
      covered, images.size(), finding.size);
  finding.expected = "cameras and IMU have the same clock";
  finding.advice = "stamp both by one clock";
  findings.push_back(std::move(finding));
}

}  // namespace

std::vector<Finding> check_stamps(std::span<const ImuSample> samples, std::span<const Time> images, const StereoRig& rig) {
  std::vector<Finding> findings;
  if (samples.size() >= kFewestStamps) check_readings(samples, rig, findings);
  if (images.size() >= kFewestStamps) check_images(images, findings);
  if (!samples.empty() && images.size() >= 2) check_clocks(samples, images, rig, findings);
  return findings;
}

}  // namespace fbvins
