// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/frame_times.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string_view>

namespace fbvins {

Result<std::vector<double>> image_intervals_s(const SimulationOptions& options) {
  std::vector<double> intervals;
  std::string_view rest = options.camera.intervals_ms;
  while (!rest.empty()) {
    std::string_view number = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(rest.size(), number.size() + 1));
    while (!number.empty() && number.front() == ' ') number.remove_prefix(1);
    double ms = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), ms);
    if (error != std::errc() || end != number.data() + number.size() || !(ms >= 5 && ms <= 1000))
      return Error{ErrorCode::invalid_argument, fmt::format("camera.intervals_ms = '{}': '{}' is no interval of 5 to 1000 ms",
                                                            options.camera.intervals_ms, number)};
    intervals.push_back(1e-3 * ms);
  }
  std::ranges::sort(intervals);
  return intervals;
}

ImageIntervals::ImageIntervals(const SimulationOptions& options)
    : intervals_s_(*image_intervals_s(options)),
      rate_hz_(options.image_rate_hz),
      stays_s_(options.camera.interval_for_s),
      seed_(static_cast<std::uint64_t>(options.seed)) {}

double ImageIntervals::at(double t_s) const {
  if (even()) return 1 / rate_hz_;
  Rng rng(seed_, 62'000'000 + static_cast<std::uint64_t>(std::max(0.0, t_s / stays_s_)));
  return intervals_s_[rng.below(intervals_s_.size())];
}

FrameTimes::FrameTimes(const SimulationOptions& options)
    : intervals_(options),
      rate_hz_(options.image_rate_hz),
      drop_share_(options.camera.drop_share),
      rng_(static_cast<std::uint64_t>(options.seed), 61) {
  advance();
}

void FrameTimes::step() {
  if (!intervals_.even() && k_ >= 0) next_s_ += intervals_.at(next_s_);
  ++k_;
  if (intervals_.even()) next_s_ = kMargin_s + static_cast<double>(k_) / rate_hz_;
}

void FrameTimes::advance() {
  do step();
  while (rng_.uniform() < drop_share_);
}

Duration stamp_error(const SimulationOptions& options, std::int64_t frame) {
  if (options.camera.stamp_noise_us == 0) return {};
  Rng rng(static_cast<std::uint64_t>(options.seed), 63'000'000 + static_cast<std::uint64_t>(frame));
  const auto intervals = image_intervals_s(options);
  const double shortest_s = intervals->empty() ? 1 / options.image_rate_hz : intervals->front(), most_s = 0.4 * shortest_s;
  return Duration::from_seconds(std::clamp(1e-6 * options.camera.stamp_noise_us * rng.normal(), -most_s, most_s));
}

}  // namespace fbvins
