// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/stereo_pairs.hpp"

#include <utility>

namespace fbvins {
namespace {

constexpr Duration kSameInstant{2'000'000};
constexpr std::size_t kLongestWait = 4;  // images of one camera without any of the other

}  // namespace

void StereoPairs::add(int camera, Time t, std::shared_ptr<const Image> image) {
  auto& own = waiting_[static_cast<std::size_t>(camera)];
  if (own.empty() || t > own.back().t) own.push_back({t, std::move(image)});
}

std::optional<StereoFrame> StereoPairs::next() {
  auto& [left, right] = waiting_;
  const auto take = [](std::deque<Waiting>& from) {
    Waiting first = std::move(from.front());
    from.pop_front();
    return first;
  };
  if (!left.empty() && !right.empty()) {
    const Duration apart = right.front().t - left.front().t;
    if (apart.ns <= kSameInstant.ns && apart.ns >= -kSameInstant.ns) {
      Waiting l = take(left);
      return StereoFrame{l.t, std::move(l.image), take(right).image};
    }
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

}  // namespace fbvins
