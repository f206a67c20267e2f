// SPDX-License-Identifier: Apache-2.0
// What the last images say of how the board is shown, before any calibration does: nowhere in view, too fast to be sharp, another
// board. One thread.
//
//   recent.add(0, frame.t, width_px, detector.find(image));
//   if (const std::string advice = recent.advice(); !advice.empty()) print(advice);
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "fbvins/calibration/board_detector.hpp"

namespace fbvins {

class RecentBoardViews {
 public:
  /// Of images that were looked at, in order of time or nearly so.
  void add(int camera, Time t, int width_px, const BoardDetection& seen, bool mirrored = false);
  /// The newest view of each camera, of those that see the board now.
  std::vector<BoardView> now() const;
  /// What to change at once, a sentence without its full stop; empty: the board is well in view.
  std::string advice() const;

 private:
  struct One {
    BoardView view;
    int tags = 0, foreign = 0, twice = 0;
    bool mirrored = false;
    double speed = 0;  ///< of the corners, image widths a second
  };
  std::deque<One> last_;  ///< of the last seconds
  double speed_ = 0;      ///< where the board was seen last
};

}  // namespace fbvins
