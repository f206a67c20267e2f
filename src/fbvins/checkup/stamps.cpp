// SPDX-License-Identifier: Apache-2.0
#include "fbvins/checkup/stamps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fbvins/checkup/image_intervals.hpp"
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

/// Stamps that are whole multiples of a common interval, off it by less than this (root mean square), are those of a regular
/// camera some of whose images were left out, on purpose or not. So long an interval is no clock's tick: that of Windows is 15.6
/// ms, of Linux 10 ms at most.
constexpr double kOnGrid_s = 5e-4, kCoarsestTick_s = 0.016;

/// From this multiple of the usual step on something is missing: readings are often stamped less regularly than images.
constexpr double kReadingGap = 2.5, kImageGap = 1.5;
/// A single reading is missing where a step is so long and its neighbours are not shorter for it.
constexpr double kSingleGap = 1.5, kThreeStepsWithGap = 3.6;
/// Readings come in bursts where so large a share of the steps is shorter than this part of the mean one.
constexpr double kMostInBursts = 0.3, kBurstStep = 0.25;
/// Readings that stay the same for so long, and at least so many of them: none were measured.
constexpr double kLongestHeld_s = 0.05;
constexpr std::size_t kFewestHeld = 4;
/// What of it is reported.
constexpr double kLongestReadingGap_s = 0.05, kMostReadingsMissing = 0.02;
constexpr double kLongestImageGap_s = 0.5, kMostImagesMissing = 0.05;
/// Images before the first reading or after the last one, for so long.
constexpr double kLongestWithoutReadings_s = 0.5;
/// An IMU that is switched on and off with the cameras begins and ends within so much of them: what lies as far off at both ends,
/// to this, is the clock.
constexpr double kSameShift_s = 1.0;

struct Gaps {
  int count = 0;
  double missing = 0, share = 0;  ///< what is missing, and out of all that there should be
  double longest_s = 0;
  Time longest_from;
};

template <class IsGap>
Gaps gaps_between(std::span<const Time> stamps, double period_s, IsGap&& is_gap) {
  Gaps gaps;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    const double step = (stamps[i] - stamps[i - 1]).seconds();
    if (step > gaps.longest_s) gaps.longest_s = step, gaps.longest_from = stamps[i - 1];
    if (!is_gap(step)) continue;
    ++gaps.count;
    gaps.missing += std::round(step / period_s) - 1;
  }
  gaps.share = gaps.missing / (gaps.missing + static_cast<double>(stamps.size()));
  return gaps;
}

/// Single readings that are missing between two: of jitter, which shortens other steps, no time is left over.
double singles_missing(std::span<const Time> stamps, double period_s, double missing_in_gaps) {
  double missing = 0;
  for (std::size_t i = 2; i + 1 < stamps.size(); ++i) {
    const double step = (stamps[i] - stamps[i - 1]).seconds();
    missing += step >= kSingleGap * period_s && step < kReadingGap * period_s &&
               (stamps[i + 1] - stamps[i - 2]).seconds() > kThreeStepsWithGap * period_s;
  }
  const double steps = static_cast<double>(stamps.size() - 1);
  const double left_over = (stamps.back() - stamps.front()).seconds() / period_s - steps - missing_in_gaps;
  return std::clamp(std::round(left_over), 0.0, missing);
}

/// The longest time in which readings stay as they are to the last bit.
Gaps longest_held(std::span<const ImuSample> samples) {
  Gaps held;
  std::size_t first = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (samples[i].gyro_radps != samples[first].gyro_radps || samples[i].accel_mps2 != samples[first].accel_mps2) first = i;
    const double for_s = (samples[i].t - samples[first].t).seconds();
    if (i + 1 - first < kFewestHeld || for_s < kLongestHeld_s) continue;
    held.count += i + 1 - first == kFewestHeld || (samples[i - 1].t - samples[first].t).seconds() < kLongestHeld_s;
    if (for_s > held.longest_s) held.longest_s = for_s, held.longest_from = samples[first].t;
  }
  return held;
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

/// The rate against the calibration's.
void check_rate(double rate, const StereoRig& rig, std::vector<Finding>& findings) {
  const double said = rig.imu_noise.rate_hz;
  if (std::abs(rate / said - 1) <= kRateTolerance) return;
  Finding finding;
  finding.kind = FindingKind::imu_stamps;
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
  findings.push_back(std::move(finding));
}

/// Readings that are the one before.
void check_repeated_readings(std::span<const ImuSample> samples, std::vector<Finding>& findings) {
  int repeated = 0;
  for (std::size_t i = 1; i < samples.size(); ++i)
    repeated += samples[i].gyro_radps == samples[i - 1].gyro_radps && samples[i].accel_mps2 == samples[i - 1].accel_mps2;
  const double share = repeated / static_cast<double>(samples.size() - 1);
  if (share > kMostRepeated) {
    Finding finding;
    finding.kind = FindingKind::imu_stamps;
    finding.size = share, finding.unit = "of the readings";
    finding.measured = fmt::format("{:.0f} % of the IMU's readings repeat the one before to the last bit", 100 * share);
    finding.expected = "noise alone makes each different";
    finding.advice = "the driver repeats readings or the IMU hangs: hand on each reading once, at the sensor's own rate";
    findings.push_back(std::move(finding));
    return;
  }
  const Gaps held = longest_held(samples);
  if (held.count == 0) return;
  Finding finding = gap_of(FindingKind::imu_gaps, held.longest_s);
  finding.measured = fmt::format("the readings stay as they are to the last bit {} time{}, the longest for {:.3f} s after {} ns",
                                 held.count, held.count == 1 ? "" : "s", held.longest_s, held.longest_from.ns);
  finding.expected = "noise alone makes each different";
  finding.advice = "the driver fills what it misses with the last reading or with zeros: leave it out, and look for what is lost";
  findings.push_back(std::move(finding));
}

/// Whether readings come in bursts, each stamped on arrival.
bool check_bursts(std::span<const double> steps_s, double mean_s, std::vector<Finding>& findings) {
  const auto shorter = std::count_if(steps_s.begin(), steps_s.end(), [&](double s) { return s < kBurstStep * mean_s; });
  const double share = static_cast<double>(shorter) / static_cast<double>(steps_s.size());
  if (share < kMostInBursts) return false;
  Finding finding;
  finding.kind = FindingKind::imu_stamps;
  finding.size = share, finding.unit = "of the readings";
  finding.measured = fmt::format(
      "{:.0f} % of the IMU's readings come within {:.1f} ms of the one before, where {:.1f} readings come in a second",
      100 * share, 1e3 * kBurstStep * mean_s, 1 / mean_s);
  finding.expected = "equal intervals";
  finding.advice =
      "readings are stamped when a block of them arrives: stamp each when it was measured, by the sensor's own clock or its rate";
  findings.push_back(std::move(finding));
  return true;
}

void check_reading_gaps(std::span<const ImuSample> samples, double rate, std::vector<Finding>& findings) {
  std::vector<Time> stamps;
  for (const ImuSample& sample : samples) stamps.push_back(sample.t);
  Gaps gaps = gaps_between(stamps, 1 / rate, [&](double step_s) { return step_s >= kReadingGap / rate; });
  const double singles = singles_missing(stamps, 1 / rate, gaps.missing);
  gaps.count += static_cast<int>(singles), gaps.missing += singles;
  gaps.share = gaps.missing / (gaps.missing + static_cast<double>(stamps.size()));
  const bool long_one = gaps.longest_s >= kLongestReadingGap_s && gaps.longest_s >= kReadingGap / rate;
  if (gaps.count == 0 || (!long_one && gaps.share < kMostReadingsMissing)) return;
  Finding finding = gap_of(FindingKind::imu_gaps, gaps.longest_s);
  finding.measured = to_text(gaps, "readings");
  finding.expected = fmt::format("a reading every {:.1f} ms", 1e3 / rate);
  finding.advice = "look for full buffers, a bus or a disk that is too slow, and a driver that waits";
  findings.push_back(std::move(finding));
}

void check_readings(std::span<const ImuSample> samples, const StereoRig& rig, std::vector<Finding>& findings) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < samples.size(); ++i) steps.push_back((samples[i].t - samples[i - 1].t).seconds());
  const double mean_s = (samples.back().t - samples.front().t).seconds() / static_cast<double>(steps.size());
  const bool bursts = check_bursts(steps, mean_s, findings);
  const double rate = 1 / std::max(bursts ? mean_s : typical_step_s(steps), 1e-9);
  check_rate(rate, rig, findings);
  check_repeated_readings(samples, findings);
  if (!bursts) check_reading_gaps(samples, rate, findings);
}

/// Missing images, of those that were taken at `period_s`; what is an interval of the camera's own is no gap.
void check_image_gaps(std::span<const Time> images, double period_s, const std::optional<IntervalModes>& modes,
                      std::vector<Finding>& findings) {
  const auto is_gap = [&](double step_s) { return step_s >= kImageGap * period_s && !(modes && modes->holds(step_s)); };
  const Gaps gaps = gaps_between(images, period_s, is_gap);
  if (gaps.count == 0 || (gaps.longest_s <= kLongestImageGap_s && gaps.share <= kMostImagesMissing)) return;
  Finding finding = gap_of(FindingKind::image_gaps, gaps.longest_s);
  finding.measured = to_text(gaps, "images");
  finding.expected = fmt::format("an image every {:.0f} ms", 1e3 * period_s);
  finding.advice = "look for a bus, a disk or a compression that is too slow; fewer images at equal intervals are better";
  findings.push_back(std::move(finding));
}

/// Longer steps are pauses.
constexpr double kPause_periods = 4;

/// Root mean square deviation of stamps whose steps are whole periods; two stamps a step.
double irregularity_s(std::span<const double> steps_s, double period_s, double most_periods = kPause_periods) {
  double sum = 0;
  int regular = 0;
  for (const double step : steps_s) {
    const double periods = std::max(std::round(step / period_s), 1.0);
    if (periods > most_periods) continue;
    sum += std::pow(step - periods * period_s, 2);
    ++regular;
  }
  return std::sqrt(sum / std::max(regular, 1) / 2);
}

/// Whether images were left out of regular ones, so that the usual step is several of the camera's.
bool is_thinned(std::span<const double> steps_s, double usual_s) {
  for (double parts = 2; usual_s / parts > kCoarsestTick_s; ++parts)
    if (irregularity_s(steps_s, usual_s / parts, std::numeric_limits<double>::infinity()) < kOnGrid_s) return true;
  return false;
}

void check_images(std::span<const Time> images, std::vector<Finding>& findings) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < images.size(); ++i) steps.push_back((images[i] - images[i - 1]).seconds());
  const double period = typical_step_s(steps);
  if (!(period > 0)) return;
  const std::optional<IntervalModes> modes = interval_modes(steps);
  check_image_gaps(images, period, modes, findings);
  const double irregular = modes ? modes->off_s : irregularity_s(steps, period);
  if (irregular < kMostIrregular_s || is_thinned(steps, period)) return;
  Finding finding;
  finding.kind = FindingKind::image_stamps;
  finding.size = 1e3 * irregular, finding.sigma = finding.size / std::sqrt(2.0 * static_cast<double>(steps.size()));
  finding.unit = "ms";
  finding.measured = fmt::format("the images' stamps are {:.1f} +- {:.1f} ms off regular intervals (root mean square)",
                                 finding.size, finding.sigma);
  finding.expected = "a camera exposes at regular times, known to a tenth of a millisecond";
  finding.advice = "stamp images by the camera's own clock or its trigger, not on arrival";
  findings.push_back(std::move(finding));
}

}  // namespace

std::optional<Finding> check_ends(const StampEnds& ends, const StereoRig& rig) {
  const Duration offset = Duration::from_seconds(rig.time_offset_s);
  const double begin_s = (ends.first_reading - ends.first_image - offset).seconds();
  const double end_s = (ends.last_reading - ends.last_image - offset).seconds();
  const bool never = ends.first_reading > ends.last_image + offset || ends.last_reading < ends.first_image + offset;
  // Recordings that are begun in the middle have a second of readings before it.
  const bool shifted = std::min(begin_s, end_s) > kLongestWithoutReadings_s ||
                       std::max(begin_s, end_s) < -kLongestWithoutReadings_s - kSameShift_s;
  const auto placed = [](double s, const char* what) {
    return fmt::format("{:.3f} s {} the {} image", std::abs(s), s > 0 ? "after" : "before", what);
  };
  if (never || (shifted && std::abs(begin_s - end_s) < kSameShift_s)) {
    Finding finding = gap_of(FindingKind::clocks_apart, begin_s);
    finding.measured = fmt::format("the readings begin {} and end {}{}", placed(begin_s, "first"), placed(end_s, "last"),
                                   never ? ": no image lies between them" : ", as if one clock were set otherwise");
    finding.expected = "cameras and IMU have the same clock";
    finding.advice = "stamp both by one clock";
    return finding;
  }
  if (std::max(begin_s, -end_s) < kLongestWithoutReadings_s) return std::nullopt;
  Finding finding = gap_of(FindingKind::imu_gaps, std::max(begin_s, -end_s));
  finding.measured =
      begin_s > -end_s ? "the readings begin " + placed(begin_s, "first") : "the readings end " + placed(end_s, "last");
  finding.expected = "there are readings for every image";
  finding.advice = "record the IMU for as long as the cameras";
  return finding;
}

std::vector<Finding> check_stamps(std::span<const ImuSample> samples, std::span<const Time> images, const StereoRig& rig,
                                  const std::optional<StampEnds>& ends) {
  std::vector<Finding> findings;
  if (samples.size() >= kFewestStamps) check_readings(samples, rig, findings);
  if (images.size() >= kFewestStamps) check_images(images, findings);
  if (samples.empty() || images.size() < 2) return findings;
  const StampEnds seen{images.front(), images.back(), samples.front().t, samples.back().t};
  if (auto finding = check_ends(ends.value_or(seen), rig)) findings.push_back(*std::move(finding));
  return findings;
}

}  // namespace fbvins
