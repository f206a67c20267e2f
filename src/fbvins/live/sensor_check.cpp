// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/sensor_check.hpp"

#include "fbvins/core/median.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "fbvins/imu/nav_state.hpp"

namespace fbvins {
namespace {

constexpr double kLongGap = 1.7;              // in periods; one lost image or reading makes two
constexpr double kRateTolerance = 0.1;        // of the calibration's
constexpr double kClockRateTolerance = 0.02;  // crystals are a thousand times better
constexpr double kMostAlone = 0.02;           // share of images without their partner
constexpr double kOneClock_s = 1;             // largest difference of camera's and IMU's delays on one clock
constexpr double kLowestImageRate_hz = 5;
constexpr double kShortestLook_s = 1;

std::string and_then(bool fine, const std::string& what_to_do) { return fine ? "" : "; " + what_to_do; }

}  // namespace

void SensorCheck::Arrivals::add(Time t, Time host_t) {
  if (!stamps.empty() && t <= stamps.back()) ++backwards;
  stamps.push_back(t);
  host.push_back(host_t);
}

double SensorCheck::Arrivals::span_s() const { return stamps.size() < 2 ? 0 : (stamps.back() - stamps.front()).seconds(); }

double SensorCheck::Arrivals::period_s() const {
  std::vector<double> steps;
  for (std::size_t k = 1; k < stamps.size(); ++k) steps.push_back((stamps[k] - stamps[k - 1]).seconds());
  return median_of(std::move(steps));
}

double SensorCheck::Arrivals::largest_gap_s() const {
  double largest = 0;
  for (std::size_t k = 1; k < stamps.size(); ++k) largest = std::max(largest, (stamps[k] - stamps[k - 1]).seconds());
  return largest;
}

double SensorCheck::Arrivals::delay_s() const {
  std::vector<double> delays;
  for (std::size_t k = 0; k < stamps.size(); ++k) delays.push_back((host[k] - stamps[k]).seconds());
  return median_of(std::move(delays));
}

void SensorCheck::push(const ImuSample& sample) {
  const std::lock_guard lock(mutex_);
  readings_.add(sample.t, now_());
  accel_sum_ += sample.accel_mps2.norm();
  gyro_sum_ += sample.gyro_radps.norm();
}

void SensorCheck::push(StereoFrame frame) {
  const std::lock_guard lock(mutex_);
  images_.add(frame.t, now_());
  for (int i = 0; i < rig_.camera_count(); ++i) {
    Watched& camera = cameras_[static_cast<std::size_t>(i)];
    const std::shared_ptr<const Image> image = frame.image(i);
    if (!image) {
      ++camera.missing;
      continue;
    }
    const Camera& lens = rig_.camera(i);
    if (image->width() != lens.width() || image->height() != lens.height())
      camera.other_width = image->width(), camera.other_height = image->height();
    if (camera.seen.is_repeated(image)) ++camera.repeated;
  }
  if (rig_.depth && !frame.depth) ++without_depth_;
}

std::vector<SensorFinding> SensorCheck::findings() const {
  const std::lock_guard lock(mutex_);
  std::vector<SensorFinding> findings;
  check_images(findings);
  check_readings(findings);
  if (!images_.stamps.empty() && !readings_.stamps.empty()) check_clocks(findings);
  return findings;
}

void SensorCheck::check_images(std::vector<SensorFinding>& findings) const {
  const auto say = [&](bool fine, std::string_view text) { findings.push_back({fine, std::string(text)}); };
  if (images_.stamps.empty()) return say(false, "no image came; is the camera plugged in, and the source's name right?");
  const double rate = images_.period_s() > 0 ? 1 / images_.period_s() : 0;
  const bool fast_enough = rate >= kLowestImageRate_hz;
  say(fast_enough,
      fmt::format("{} frames, {:.1f} a second{}", images_.stamps.size(), rate,
                  and_then(fast_enough, fmt::format("fewer than {} a second lose the scene in motion", kLowestImageRate_hz))));
  const bool steady = images_.largest_gap_s() < kLongGap * images_.period_s();
  say(steady, fmt::format("longest time between two images {:.0f} ms{}", 1e3 * images_.largest_gap_s(),
                          and_then(steady, "images are lost on their way: cable, USB bandwidth, a busy machine")));
  if (images_.backwards > 0)
    say(false, fmt::format("{} images have stamps that do not ascend; the driver stamps wrongly", images_.backwards));
  for (int i = 0; i < rig_.camera_count(); ++i) check_camera(i, findings);
  if (without_depth_ > kMostAlone * static_cast<double>(images_.stamps.size()))
    say(false,
        fmt::format("{} images came without a depth image; are the depth sensor's stamps those of the camera?", without_depth_));
}

void SensorCheck::check_camera(int number, std::vector<SensorFinding>& findings) const {
  const auto say = [&](std::string_view text) { findings.push_back({false, fmt::format("camera {}: {}", number, text)}); };
  const Watched& camera = cameras_[static_cast<std::size_t>(number)];
  const std::size_t frames = images_.stamps.size();
  if (camera.missing > kMostAlone * static_cast<double>(frames))
    say(fmt::format("{} of {} frames came without its image; is it plugged in, and are all cameras triggered together?",
                    camera.missing, frames));
  if (camera.repeated > 0) say(fmt::format("{} images are earlier ones to the last bit; it hangs", camera.repeated));
  const Camera& lens = rig_.camera(number);
  if (camera.other_width > 0)
    say(fmt::format("an image is {} x {}, in the calibration it is {} x {}; calibrate at the size that is used",
                    camera.other_width, camera.other_height, lens.width(), lens.height()));
}

void SensorCheck::check_readings(std::vector<SensorFinding>& findings) const {
  const auto say = [&](bool fine, std::string_view text) { findings.push_back({fine, std::string(text)}); };
  if (readings_.stamps.empty()) return say(false, "no IMU reading came; is the IMU on?");
  const double rate = readings_.period_s() > 0 ? 1 / readings_.period_s() : 0, expected = rig_.imu_noise.rate_hz;
  const bool as_calibrated = std::abs(rate - expected) <= kRateTolerance * expected;
  say(as_calibrated,
      fmt::format("{} IMU readings, {:.0f} a second{}", readings_.stamps.size(), rate,
                  and_then(as_calibrated, fmt::format("the calibration says {:.0f}, and the covariance rests on it", expected))));
  const bool steady = readings_.largest_gap_s() < kLongGap * readings_.period_s();
  say(steady, fmt::format("longest time between two readings {:.1f} ms{}", 1e3 * readings_.largest_gap_s(),
                          and_then(steady, "readings are lost, which makes the estimate worse")));
  if (readings_.backwards > 0)
    say(false, fmt::format("{} readings have stamps that do not ascend; the driver stamps wrongly", readings_.backwards));
  const auto count = static_cast<double>(readings_.stamps.size());
  const double accel = accel_sum_ / count, gyro = gyro_sum_ / count;
  const bool metric = accel > 0.7 * kGravity_mps2 && accel < 1.5 * kGravity_mps2;
  const bool in_g = accel > 0.7 && accel < 1.5;
  say(metric, fmt::format("mean acceleration {:.2f} m/s^2{}", accel,
                          and_then(metric, in_g ? "it looks like g: multiply by 9.80665"
                                                : "gravity alone is 9.81: units or axes are wrong")));
  constexpr double kSpinning_radps = 6;  // mean over the check; nobody turns a drone that fast by hand
  const bool calm = gyro < kSpinning_radps;
  say(calm, fmt::format("mean angular rate {:.3f} rad/s{}", gyro, and_then(calm, "it looks like degrees: multiply by pi / 180")));
}

void SensorCheck::check_clocks(std::vector<SensorFinding>& findings) const {
  const double between = images_.delay_s() - readings_.delay_s();
  const bool one_clock = std::abs(between) < kOneClock_s;
  findings.push_back({one_clock, fmt::format("images come {:.0f} ms after readings of the same stamp{}", 1e3 * between,
                                             and_then(one_clock, "camera and IMU do not stamp by one clock"))});
  const double span = readings_.span_s(), host_span = (readings_.host.back() - readings_.host.front()).seconds();
  if (span < kShortestLook_s || host_span <= 0) return;
  const double rate = span / host_span / clock_rate_;
  const bool same_second = std::abs(rate - 1) < kClockRateTolerance;
  findings.push_back(
      {same_second, fmt::format("a second of the sensors' clock takes {:.3f} s{}", 1 / rate,
                                and_then(same_second, "stamps are in another unit, or counted instead of measured"))});
}

}  // namespace fbvins
