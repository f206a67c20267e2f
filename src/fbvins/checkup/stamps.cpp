// SPDX-License-Identifier: Apache-2.0
#include "fbvins/checkup/stamps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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

/// From this multiple of the usual step on something is missing: readings are often stamped less regularly than images.
constexpr double kReadingGap = 2.5, kImageGap = 1.5;
/// What of it is reported.
constexpr double kLongestReadingGap_s = 0.05, kMostReadingsMissing = 0.02;
constexpr double kLongestImageGap_s = 0.5, kMostImagesMissing = 0.05;
/// Images before the first reading or after the last one, for so long.
constexpr double kLongestWithoutReadings_s = 0.5;

struct Gaps {
  int count = 0;
  double missing = 0, share = 0;  ///< what is missing, and out of all that there should be
  double longest_s = 0;
  Time longest_from;
};

Gaps gaps_between(std::span<const Time> stamps, double period_s, double gap_periods) {
  Gaps gaps;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    const double step = (stamps[i] - stamps[i - 1]).seconds();
    if (step > gaps.longest_s) gaps.longest_s = step, gaps.longest_from = stamps[i - 1];
    if (step < gap_periods * period_s) continue;
    ++gaps.count;
    gaps.missing += std::round(step / period_s) - 1;
  }
  gaps.share = gaps.missing / (gaps.missing + static_cast<double>(stamps.size()));
  return gaps;
}

std::string to_text(const Gaps& gaps, std::string_view what) {
  return fmt::format("{:.0f} {} ({:.1f} %) are missing in {} gap{}, the longest of {:.3f} s after {} ns", gaps.missing, what,
                     100 * gaps.share, gaps.count, gaps.count == 1 ? "" : "s", gaps.longest_s, gaps.longest_from.ns);
}

Finding gap_of(FindingKind kind, double longest_s) {
  Finding finding;
  finding.kind = kind, finding.size = longest_s, finding.unit = "s";
  return finding;
}

double typical_step_s(std::vector<double> steps) { return median(steps); }

/// In which unit stamps are, where they go so many times as slowly as nanoseconds would; null where in none.
const char* unit_of_stamps(double slower) {
  if (std::abs(slower / 1e3 - 1) < kRateTolerance) return "microseconds";
  if (std::abs(slower / 1e6 - 1) < kRateTolerance) return "milliseconds";
  return nullptr;
}

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
    if (const char* unit = unit_of_stamps(rate / said)) {
      finding.advice = fmt::format("the stamps look like {}: give nanoseconds", unit);
    } else {
      finding.advice = "correct the rate, on which the covariance rests";
      finding.corrected = fmt::format("rate_hz: {:.0f}", rate);
      finding.fields = {CalibrationField::imu_rate};
    }
    findings.push_back(finding);
  }
  const double share = repeated / static_cast<double>(steps.size());
  if (share > kMostRepeated) {
    finding.size = share, finding.unit = "of the readings", finding.corrected.clear(), finding.fields.clear();
    finding.measured = fmt::format("{:.0f} % of the IMU's readings repeat the one before to the last bit", 100 * share);
    finding.expected = "noise alone makes each different";
    finding.advice = "the driver repeats readings or the IMU hangs: hand on each reading once, at the sensor's own rate";
    findings.push_back(finding);
  }
  std::vector<Time> stamps;
  for (const ImuSample& sample : samples) stamps.push_back(sample.t);
  const Gaps gaps = gaps_between(stamps, 1 / rate, kReadingGap);
  if (gaps.count == 0 || (gaps.longest_s < kLongestReadingGap_s && gaps.share < kMostReadingsMissing)) return;
  finding = gap_of(FindingKind::imu_gaps, gaps.longest_s);
  finding.measured = to_text(gaps, "readings");
  finding.expected = fmt::format("a reading every {:.1f} ms", 1e3 / rate);
  finding.advice = "look for full buffers, a bus or a disk that is too slow, and a driver that waits";
  findings.push_back(finding);
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
  const Gaps gaps = gaps_between(images, period, kImageGap);
  if (gaps.count > 0 && (gaps.longest_s > kLongestImageGap_s || gaps.share > kMostImagesMissing)) {
    Finding finding = gap_of(FindingKind::image_gaps, gaps.longest_s);
    finding.measured = to_text(gaps, "images");
    finding.expected = fmt::format("an image every {:.0f} ms", 1e3 * period);
    finding.advice = "look for a bus, a disk or a compression that is too slow; fewer images at equal intervals are better";
    findings.push_back(std::move(finding));
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
  if (2 * static_cast<std::size_t>(covered) >= images.size()) {
    const double before_s = (samples.front().t - images.front() - offset).seconds();
    const double after_s = (images.back() + offset - samples.back().t).seconds();
    if (std::max(before_s, after_s) < kLongestWithoutReadings_s) return;
    Finding finding = gap_of(FindingKind::imu_gaps, std::max(before_s, after_s));
    finding.measured = before_s > after_s ? fmt::format("the readings begin {:.3f} s after the first image", before_s)
                                          : fmt::format("the readings end {:.3f} s before the last image", after_s);
    finding.expected = "there are readings for every image";
    finding.advice = "record the IMU for as long as the cameras";
    findings.push_back(std::move(finding));
    return;
  }
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
