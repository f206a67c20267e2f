// SPDX-License-Identifier: Apache-2.0
// Anchors on their way to the map: they wait for the keyframe that follows them. One thread at a time.
//
//   anchors.add(std::move(frame.anchors));          // every frame
//   keyframe.anchors = anchors.until(keyframe.t);   // every keyframe, in order
//   anchors.add(std::move(keyframe.anchors));       // a keyframe that nobody takes
#pragma once

#include <algorithm>
#include <iterator>
#include <vector>

#include "fbvins/types/anchor.hpp"

namespace fbvins {

class KeyframeAnchors {
 public:
  void add(std::vector<Anchor> anchors) {
    waiting_.insert(waiting_.end(), std::make_move_iterator(anchors.begin()), std::make_move_iterator(anchors.end()));
    if (waiting_.size() > kMost) waiting_.erase(waiting_.begin(), waiting_.end() - kMost);
  }
  /// Those that are not later, in order of time.
  std::vector<Anchor> until(Time t) {
    const auto later = std::stable_partition(waiting_.begin(), waiting_.end(), [t](const Anchor& a) { return stamp_of(a) <= t; });
    std::vector<Anchor> out(std::make_move_iterator(waiting_.begin()), std::make_move_iterator(later));
    waiting_.erase(waiting_.begin(), later);
    std::stable_sort(out.begin(), out.end(), [](const Anchor& a, const Anchor& b) { return stamp_of(a) < stamp_of(b); });
    return out;
  }

 private:
  /// An estimator that does not start never takes any.
  static constexpr std::size_t kMost = 1024;

  std::vector<Anchor> waiting_;
};

}  // namespace fbvins
