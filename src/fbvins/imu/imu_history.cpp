// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/imu_history.hpp"

#include <algorithm>

namespace fbvins {
namespace {

/// Of an IMU this slow a step of up to so many of its periods is regular, and counts as a gap that is bridged everywhere.
constexpr Duration kSlow{20'000'000}, kSlowest{100'000'000}, kBridged{50'000'000};
constexpr double kRegular_periods = 1.6;

bool earlier(const ImuSample& sample, Time t) { return sample.t < t; }
bool later(Time t, const ImuSample& sample) { return t < sample.t; }

ImuSample held(const ImuSample& sample, Time t) { return {t, sample.gyro_radps, sample.accel_mps2}; }

ImuSample interpolated(const ImuSample& a, const ImuSample& b, Time t) {
  const double x = static_cast<double>((t - a.t).ns) / static_cast<double>((b.t - a.t).ns);
  return {t, (1 - x) * a.gyro_radps + x * b.gyro_radps, (1 - x) * a.accel_mps2 + x * b.accel_mps2};
}

}  // namespace

ImuHistory::ImuHistory(const ImuNoise& imu, Duration time_offset, const ImuHistoryOptions& options)
    : time_offset_(time_offset), options_(options), judge_(imu), axes_(imu.axes) {
  readings_.reserve(512);
}

bool ImuHistory::add(const ImuSample& reading) {
  if (!judge_.accepts(reading)) return false;
  if (size() >= options_.capacity) {  // a tenth at once, so that a full history is not shifted at each reading
    const int surplus = std::max(1, options_.capacity / 10);
    readings_.erase(readings_.begin(), readings_.begin() + surplus);
    overflow_ += surplus;
  }
  readings_.push_back(corrected(reading, axes_));
  readings_.back().t = reading.t - time_offset_;
  if (readings_.size() > 1) note_period(readings_.back().t - readings_[readings_.size() - 2].t);
  return true;
}

/// The shortest one counts: a fast IMU that becomes slow in flight has gaps.
void ImuHistory::note_period(Duration interval) {
  period_.add(interval);
  if (const std::optional<Duration> now = period_.median()) shortest_period_ = std::min(shortest_period_.value_or(*now), *now);
}

bool ImuHistory::is_own_step(Duration step) const {
  return shortest_period_ && *shortest_period_ > kSlow && *shortest_period_ <= kSlowest &&
         step.seconds() <= kRegular_periods * shortest_period_->seconds();
}

void ImuHistory::set_time_offset(Duration offset) {
  if (offset == time_offset_) return;
  for (ImuSample& reading : readings_) reading.t = reading.t + (time_offset_ - offset);
  time_offset_ = offset;
}

ImuSegment ImuHistory::between(Time from, Time to) const {
  ImuSegment segment;
  segment.time_offset = time_offset_;
  if (readings_.empty() || from >= to) return segment;
  const auto first = std::upper_bound(readings_.begin(), readings_.end(), from, later);
  const auto last = std::lower_bound(first, readings_.end(), to, earlier);
  segment.longest_gap = longest_gap(from, to);
  const bool inside_a_gap = first == last && !(last != readings_.end() && last->t == to);
  if (inside_a_gap && segment.longest_gap.seconds() > options_.longest_hold_s) return segment;
  segment.samples.reserve(static_cast<std::size_t>(last - first) + 2);
  segment.samples.push_back(at(from));
  segment.samples.insert(segment.samples.end(), first, last);
  segment.samples.push_back(at(to));
  return segment;
}

void ImuHistory::forget_before(Time t) {
  const auto keep = std::upper_bound(readings_.begin(), readings_.end(), t, later);
  if (keep == readings_.begin()) return;
  readings_.erase(readings_.begin(), keep - 1);  // the last reading at or before t serves the next segment
}

ImuCounts ImuHistory::counts() const {
  ImuCounts counts = judge_.counts();
  counts.overflow = overflow_;
  return counts;
}

ImuSample ImuHistory::at(Time t) const {
  const auto after = std::lower_bound(readings_.begin(), readings_.end(), t, earlier);
  if (after == readings_.end()) return held(readings_.back(), t);
  if (after->t == t || after == readings_.begin()) return held(*after, t);
  const ImuSample& before = *(after - 1);
  if ((after->t - before.t).seconds() <= options_.longest_interpolation_s || is_own_step(after->t - before.t))
    return interpolated(before, *after, t);
  return held(t - before.t <= after->t - t ? before : *after, t);
}

Duration ImuHistory::longest_gap(Time from, Time to) const {
  // The neighbours outside count, too: a gap that image stamps cut in two is still one gap.
  Duration longest{};
  if (readings_.front().t > from) longest = std::min(readings_.front().t, to) - from;
  if (readings_.back().t < to) longest = std::max(longest, to - readings_.back().t);
  for (std::size_t k = 1; k < readings_.size() && readings_[k - 1].t < to; ++k)
    if (readings_[k].t > from) longest = std::max(longest, readings_[k].t - readings_[k - 1].t);
  return is_own_step(longest) ? std::min(longest, kBridged) : longest;
}

}  // namespace fbvins
