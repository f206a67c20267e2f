// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/imu_buffer.hpp"

#include <algorithm>

namespace fbvins {
namespace {

bool earlier(const ImuSample& sample, Time t) { return sample.t < t; }

ImuSample held(const ImuSample& sample, Time t) { return {t, sample.gyro_radps, sample.accel_mps2}; }

ImuSample interpolated(const ImuSample& a, const ImuSample& b, Time t) {
  const double x = static_cast<double>((t - a.t).ns) / static_cast<double>((b.t - a.t).ns);
  return {t, (1 - x) * a.gyro_radps + x * b.gyro_radps, (1 - x) * a.accel_mps2 + x * b.accel_mps2};
}

}  // namespace

ImuBuffer::ImuBuffer(const ImuBufferOptions& options) : options_(options) { samples_.reserve(512); }

bool ImuBuffer::push(const ImuSample& sample) {
  const bool plausible = sample.gyro_radps.allFinite() && sample.accel_mps2.allFinite() &&
                         sample.gyro_radps.cwiseAbs().maxCoeff() <= options_.max_gyro_radps &&
                         sample.accel_mps2.cwiseAbs().maxCoeff() <= options_.max_accel_mps2;
  if (!plausible) {
    ++counts_.invalid;
    return false;
  }
  if (newest_ && sample.t <= *newest_) {
    ++(sample.t == *newest_ ? counts_.duplicate : counts_.backward);
    return false;
  }
  if (size() >= options_.capacity) {  // a tenth at once, so that a full buffer is not shifted at each reading
    const int surplus = std::max(1, options_.capacity / 10);
    samples_.erase(samples_.begin(), samples_.begin() + surplus);
    counts_.overflow += surplus;
  }
  samples_.push_back(sample);
  newest_ = sample.t;
  ++counts_.accepted;
  return true;
}

bool ImuBuffer::covers(Time to) const { return !samples_.empty() && samples_.back().t >= to; }

std::optional<ImuSegment> ImuBuffer::extract(Time from, Time to) {
  if (!covers(to) || from >= to) return std::nullopt;
  return extract_now(from, to);
}

ImuSegment ImuBuffer::extract_now(Time from, Time to) {
  ImuSegment segment;
  if (samples_.empty() || from >= to) return segment;
  const auto first = std::upper_bound(samples_.begin(), samples_.end(), from, [](Time t, const ImuSample& s) { return t < s.t; });
  const auto last = std::lower_bound(first, samples_.end(), to, earlier);
  segment.samples.reserve(static_cast<std::size_t>(last - first) + 2);
  segment.samples.push_back(at(from));
  segment.samples.insert(segment.samples.end(), first, last);
  segment.samples.push_back(at(to));
  segment.longest_gap = longest_gap(from, to);
  drop_before(to);
  return segment;
}

ImuSample ImuBuffer::at(Time t) const {
  const auto after = std::lower_bound(samples_.begin(), samples_.end(), t, earlier);
  if (after == samples_.end()) return held(samples_.back(), t);
  if (after->t == t || after == samples_.begin()) return held(*after, t);
  const ImuSample& before = *(after - 1);
  if ((after->t - before.t).seconds() <= options_.longest_interpolation_s) return interpolated(before, *after, t);
  return held(t - before.t <= after->t - t ? before : *after, t);
}

Duration ImuBuffer::longest_gap(Time from, Time to) const {
  // The neighbours outside count, too: a gap that an image stamp cuts in two is still one gap.
  Duration longest{};
  if (samples_.front().t > from) longest = std::min(samples_.front().t, to) - from;
  if (samples_.back().t < to) longest = std::max(longest, to - std::max(samples_.back().t, from));
  for (std::size_t k = 1; k < samples_.size() && samples_[k - 1].t < to; ++k)
    if (samples_[k].t > from) longest = std::max(longest, samples_[k].t - samples_[k - 1].t);
  return longest;
}

void ImuBuffer::drop_before(Time t) {
  const auto keep =
      std::upper_bound(samples_.begin(), samples_.end(), t, [](Time time, const ImuSample& s) { return time < s.t; });
  if (keep == samples_.begin()) return;
  samples_.erase(samples_.begin(), keep - 1);  // the last reading at or before t serves the next segment
}

}  // namespace fbvins
