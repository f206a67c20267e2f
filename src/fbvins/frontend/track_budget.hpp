// SPDX-License-Identifier: Apache-2.0
// How many features each group of cameras of a rig may follow: an equal share of the rig's number, and what others cannot use,
// because they are dark, covered, or look at a plain wall. A value; one thread at a time.
//
//   TrackBudget budget(150, 2);                       // 200 in all, up to 150 for one
//   for (int k = 0; k < 2; ++k) budget.note(k, follow(k, budget.of(k)));
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace fbvins {

class TrackBudget {
 public:
  /// `alone`: what a rig of one group follows, which is the most that one of several may. Two groups follow a third more, three
  /// or more twice as many.
  TrackBudget(int alone, std::size_t groups)
      : alone_(alone),
        rig_(static_cast<int>(groups) > 1 ? 2 * alone * std::min(static_cast<int>(groups), 3) / 3 : alone),
        share_(std::max(1, rig_ / static_cast<int>(std::max<std::size_t>(1, groups)))),
        used_(groups, share_) {}

  int of(std::size_t group) const {
    const int others = std::accumulate(used_.begin(), used_.end(), 0) - used_[group];
    return std::clamp(rig_ - others, share_, alone_);
  }
  /// What a group follows. That it follows less counts little by little: most often it finds others soon.
  void note(std::size_t group, int followed) { used_[group] = std::max(followed, used_[group] - std::max(1, share_ / kImages)); }

 private:
  /// Until what a group does not use is another's.
  static constexpr int kImages = 20;

  int alone_, rig_, share_;
  std::vector<int> used_;
};

}  // namespace fbvins
