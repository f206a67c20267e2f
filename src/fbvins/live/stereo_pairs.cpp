// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/stereo_pairs.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace fbvins {
namespace {

constexpr Duration kSameInstant{2'000'000};
constexpr std::size_t kLongestWait = 4;  // images of one camera without any of the other

}  // namespace

void StereoPairs::add(int camera, Time t, std::shared_ptr<const Image> image) {
  const auto at = static_cast<std::size_t>(camera);
  if (newest_[at] && t <= *newest_[at]) return;
  if (newest_[at]) interval_[at] = t - *newest_[at];
  newest_[at] = t;
  waiting_[at].push_back({t, std::move(image)});
}

StereoPairs::Waiting StereoPairs::take(std::deque<Waiting>& from) {
  Waiting first = std::move(from.front());
  from.pop_front();
  return first;
}

std::optional<StereoFrame> StereoPairs::next() { return without_trigger() ? next_without_trigger() : next_of_pairs(); }

std::optional<StereoFrame> StereoPairs::next_of_pairs() {
  auto& [left, right] = waiting_;
  if (!left.empty() && !right.empty()) {
    const Duration apart = right.front().t - left.front().t;
    if (apart.ns <= kSameInstant.ns && apart.ns >= -kSameInstant.ns) {
      apart_ = 0;
      Waiting l = take(left);
      return StereoFrame{l.t, std::move(l.image), take(right).image};
    }
    ++apart_;
  }
  const bool left_is_alone = !left.empty() && (right.empty() ? left.size() >= kLongestWait : left.front().t < right.front().t);
  if (left_is_alone) {
    Waiting l = take(left);
    return StereoFrame{l.t, std::move(l.image), nullptr};
  }
  const bool right_is_alone = !right.empty() && (left.empty() ? right.size() >= kLongestWait : right.front().t < left.front().t);
  if (!right_is_alone) return std::nullopt;
  Waiting r = take(right);
  return StereoFrame{r.t, nullptr, std::move(r.image)};
}

/// Whether all right images are there that could be a partner of a left one: a later one has come, or the next one comes too
/// late, as far as the interval tells.
bool StereoPairs::partners_are_there(Time left) const {
  if (!newest_[1]) return false;
  return *newest_[1] > left || *newest_[1] + interval_[1] > left + Duration{interval_[0].ns / 4};
}

std::optional<StereoFrame> StereoPairs::next_without_trigger() {
  auto& [left, right] = waiting_;
  if (left.empty()) {
    if (right.size() < kLongestWait) return std::nullopt;
    Waiting r = take(right);
    return StereoFrame{r.t, nullptr, std::move(r.image)};
  }
  if (!partners_are_there(left.front().t) && left.size() < kLongestWait) return std::nullopt;
  Waiting l = take(left);
  StereoFrame frame{l.t, std::move(l.image), nullptr};
  const Time wanted = l.t - Duration{interval_[0].ns / 4};
  const auto distance = [&](const Waiting& w) { return std::abs((w.t - wanted).ns); };
  const auto nearest = std::ranges::min_element(right, {}, distance);
  if (nearest == right.end() || distance(*nearest) > interval_[0].ns / 2) return frame;
  frame.offsets.set(1, nearest->t - l.t);
  frame.right = std::move(nearest->image);
  right.erase(right.begin(), nearest + 1);
  return frame;
}

}  // namespace fbvins
