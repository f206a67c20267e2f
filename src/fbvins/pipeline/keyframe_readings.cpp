// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/keyframe_readings.hpp"

#include <iterator>
#include <utility>

namespace fbvins {
namespace {

/// Older readings are dropped, as an estimator that does not start never takes any.
constexpr double kLongest_s = 10;

bool joined(const std::vector<ImuSegment>& segments) {
  for (std::size_t i = 1; i < segments.size(); ++i)
    if (segments[i].samples.front().t != segments[i - 1].samples.back().t) return false;
  return true;
}

}  // namespace

void KeyframeReadings::add(const ImuSegment& segment) {
  if (segment.empty()) return;
  segments_.push_back(segment);
  drop_old();
}

void KeyframeReadings::drop_old() {
  // The newest one stays, however long it is: a camera may have been silent for that time.
  while (segments_.size() > 1 && (segments_.back().samples.back().t - segments_.front().samples.front().t).seconds() > kLongest_s)
    segments_.pop_front();
}

std::vector<ImuSegment> KeyframeReadings::until(Time t) {
  std::vector<ImuSegment> out;
  while (!segments_.empty() && segments_.front().samples.back().t <= t) {
    out.push_back(std::move(segments_.front()));
    segments_.pop_front();
  }
  handed_out_before_ = handed_out_until_;
  const Time from = std::exchange(handed_out_until_, t);
  const bool whole = !out.empty() && joined(out) && out.front().samples.front().t == from && out.back().samples.back().t == t;
  return whole ? out : std::vector<ImuSegment>{};
}

void KeyframeReadings::take_back(std::vector<ImuSegment> segments) {
  if (segments.empty()) return;  // some were missing, and are from now on
  handed_out_until_ = handed_out_before_;
  segments_.insert(segments_.begin(), std::make_move_iterator(segments.begin()), std::make_move_iterator(segments.end()));
  drop_old();
}

}  // namespace fbvins
