// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/imu_history.hpp"

#include <algorithm>

namespace fbvins {
namespace {

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
  return true;
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
  if ((after->t - before.t).seconds() <= options_.longest_interpolation_s) return interpolated(before, *after, t);
  return held(t - before.t <= after->t - t ? before : *after, t);
}

Duration ImuHistory::longest_gap(Time from, Time to) const {
  // The neighbours outside count, too: a gap that image stamps cut in two is still one gap.
  Duration longest{};
  if (readings_.front().t > from) longest = std::min(readings_.front().t, to) - from;
  if (readings_.back().t < to) longest = std::max(longest, to - readings_.back().t);
  for (std::size_t k = 1; k < readings_.size() && readings_[k - 1].t < to; ++k)
    if (readings_[k].t > from) longest = std::max(longest, readings_[k].t - readings_[k - 1].t);
  return longest;
}

}  // namespace fbvins
