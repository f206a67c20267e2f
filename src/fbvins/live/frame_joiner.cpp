// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/frame_joiner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace fbvins {
namespace {

constexpr std::size_t kLongestWait = 4;  // images of one camera without any of another
/// A camera is silent when none of its images came for so many of its periods, beyond its usual lag. One lost image is no
/// silence, nor are two that come in one burst after another camera's two.
constexpr double kSilentPeriods = 2.5;
/// And one that never delivered, this long after the first image of another.
constexpr Duration kLongestStart{1'000'000'000};

}  // namespace

bool FrameJoiner::are_one_instant(Time a, Time b) const { return std::abs((a - b).ns) <= tolerance_.ns; }

void FrameJoiner::put(std::size_t stream, Time stamp, Pixels pixels) {
  Stream& to = streams_[stream];
  const Time t = stamp + own_.of(static_cast<int>(stream));
  if (to.newest && t <= *to.newest) return;
  to.before = to.interval;
  if (to.newest) to.interval = t - *to.newest;
  to.period.add(to.interval);
  to.newest = t;
  began_ = began_.value_or(t);
  now_ = std::max(now_.value_or(t), t);
  to.lag = std::max(*now_ - t, Duration{to.lag.ns - to.lag.ns / 16});
  const bool too_late = delivered_ && t <= *delivered_ + tolerance_;
  if (!too_late || is_free(to)) to.waiting.push_back({t, std::move(pixels)});
  else ++dropped_;
}

bool FrameJoiner::is_silent(const Stream& stream) const {
  if (!now_ || !stream.waiting.empty()) return false;
  if (!stream.newest) return *now_ - *began_ > kLongestStart;
  const std::optional<Duration> period = stream.period.median();
  return period && (*now_ - *stream.newest - stream.lag).seconds() > kSilentPeriods * period->seconds();
}

/// Of those with a common trigger.
std::optional<Time> FrameJoiner::first_waiting() const {
  std::optional<Time> first;
  for (const Stream& stream : streams_)
    if (!is_free(stream) && !stream.waiting.empty())
      first = first ? std::min(*first, stream.waiting.front().t) : stream.waiting.front().t;
  return first;
}

/// Whether no image is missing that could still come to the frame of that time.
bool FrameJoiner::is_complete(Time first) const {
  bool all_there = true, long_enough = false;
  for (const Stream& stream : streams_) {
    if (is_free(stream)) continue;
    all_there &= !stream.waiting.empty() || is_silent(stream);
    long_enough |= stream.waiting.size() >= kLongestWait;
  }
  return long_enough || (all_there && free_ones_are_there(first));
}

/// Whether all images are there that could be a partner of one at `t`: a later one has come, or the next one comes too late, as
/// far as the interval tells.
bool FrameJoiner::free_ones_are_there(Time t) const {
  const Duration quarter{streams_.front().interval.ns / 4};
  return std::ranges::all_of(streams_, [&](const Stream& stream) {
    if (!is_free(stream) || is_silent(stream)) return true;
    return stream.newest && (*stream.newest > t || *stream.newest + stream.interval > t + quarter);
  });
}

/// Before a frame leaves: which cameras deliver images, and never at one instant with camera 0.
void FrameJoiner::count_apart(Time first) {
  const Stream& zero = streams_.front();
  if (zero.waiting.empty()) return;
  for (int i = 1; i < cameras_; ++i) {
    Stream& stream = streams_[static_cast<std::size_t>(i)];
    if (is_free(stream) || stream.waiting.empty()) continue;
    const Time t0 = zero.waiting.front().t, t = stream.waiting.front().t;
    if (are_one_instant(t0, t)) stream.apart = 0;
    else if (are_one_instant(std::min(t0, t), first)) ++stream.apart;
  }
}

void FrameJoiner::take_first(std::size_t stream, StereoFrame& frame) {
  Waiting first = std::move(streams_[stream].waiting.front());
  streams_[stream].waiting.pop_front();
  if (auto* depth = std::get_if<std::shared_ptr<const DepthImage>>(&first.pixels)) frame.depth = std::move(*depth);
  else frame.set_image(static_cast<int>(stream), std::get<std::shared_ptr<const Image>>(std::move(first.pixels)));
}

/// Of a camera without a common trigger: the image nearest to a quarter of an interval before the frame.
void FrameJoiner::take_nearest(std::size_t stream, StereoFrame& frame) {
  std::deque<Waiting>& waiting = streams_[stream].waiting;
  const Duration interval = streams_.front().interval;
  const Time wanted = frame.t - Duration{interval.ns / 4};
  const auto distance = [&](const Waiting& w) { return std::abs((w.t - wanted).ns); };
  const auto nearest = std::ranges::min_element(waiting, {}, distance);
  if (nearest == waiting.end() || distance(*nearest) > interval.ns / 2) return;
  waiting.erase(waiting.begin(), nearest);
  frame.offsets.set(static_cast<int>(stream), waiting.front().t - frame.t);
  take_first(stream, frame);
}

/// While no camera with a common trigger delivers.
std::optional<StereoFrame> FrameJoiner::of_a_free_one() {
  const bool waited = std::ranges::any_of(streams_, [](const Stream& s) { return s.waiting.size() >= kLongestWait; });
  if (!waited && !std::ranges::all_of(streams_, [&](const Stream& s) { return is_free(s) || is_silent(s); })) return std::nullopt;
  std::size_t earliest = streams_.size();
  for (std::size_t i = 0; i < streams_.size(); ++i)
    if (!streams_[i].waiting.empty() &&
        (earliest == streams_.size() || streams_[i].waiting.front().t < streams_[earliest].waiting.front().t))
      earliest = i;
  if (earliest == streams_.size()) return std::nullopt;
  StereoFrame frame{streams_[earliest].waiting.front().t};
  take_first(earliest, frame);
  return frame;
}

StereoFrame FrameJoiner::join(Time first) {
  StereoFrame frame;
  std::optional<Time> t;  // of the camera with the lowest number
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    const std::deque<Waiting>& waiting = streams_[i].waiting;
    if (is_free(streams_[i]) || waiting.empty() || !are_one_instant(waiting.front().t, first)) continue;
    if (!t) t = waiting.front().t;
    take_first(i, frame);
  }
  frame.t = t.value_or(first);
  for (std::size_t i = 0; i < streams_.size(); ++i)
    if (is_free(streams_[i])) take_nearest(i, frame);
  return frame;
}

std::optional<StereoFrame> FrameJoiner::next_by_exposure() {
  while (const std::optional<Time> first = first_waiting()) {
    if (!is_complete(*first)) return std::nullopt;
    count_apart(*first);
    StereoFrame frame = join(*first);
    if (frame.without_images()) continue;
    if (!is_stray(frame)) return counted(std::move(frame));
    ++dropped_;
  }
  if (auto frame = of_a_free_one()) return counted(*std::move(frame));
  return std::nullopt;
}

/// Whether a frame without camera 0 is too near to one of camera 0 to be another moment.
bool FrameJoiner::is_stray(const StereoFrame& frame) const {
  if (frame.left()) return false;
  const Stream& zero = streams_.front();
  // A lost image makes one interval as long as two.
  const Duration interval = zero.before.ns > 0 ? std::min(zero.interval, zero.before) : zero.interval;
  const auto is_near = [&](Time t) { return 2 * std::abs((t - frame.t).ns) <= interval.ns; };
  return (last_zero_ && is_near(*last_zero_)) || (!zero.waiting.empty() && is_near(zero.waiting.front().t));
}

StereoFrame FrameJoiner::counted(StereoFrame frame) {
  bool whole = true;
  for (int i = 0; i < cameras_; ++i) whole &= frame.image(i) != nullptr;
  ++(whole ? whole_ : parts_);
  if (frame.left()) last_zero_ = frame.t;
  return frame;
}

std::string FrameJoiner::report() const {
  if (parts_ + dropped_ == 0) return {};
  return fmt::format(
      "{} frames with the images of all cameras; {} with those of some, {} images dropped, without partner within {} ms", whole_,
      parts_, dropped_, 1e3 * tolerance_.seconds());
}

std::optional<StereoFrame> FrameJoiner::next() {
  std::optional<StereoFrame> frame = next_by_exposure();
  if (!frame) return std::nullopt;
  delivered_ = frame->t;
  frame->offsets -= own_;
  return frame;
}

}  // namespace fbvins
