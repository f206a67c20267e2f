// SPDX-License-Identifier: Apache-2.0
// How uncertain the scale of a flight of one camera is as a whole, from what its keyframes say (docs/derivations/loop.md, L33). A
// value; one thread at a time.
//
//   FlightScale scale;
//   scale.add(keyframe.scale_sigma);
//   session.scale_sigma = scale.sigma();
#pragma once

#include <algorithm>
#include <cmath>

namespace fbvins {

class FlightScale {
 public:
  /// Of a keyframe; 0: its cameras measure lengths.
  void add(double sigma) {
    if (sigma > 0) information_ += 1 / (sigma * sigma), ++keyframes_;
  }
  /// The errors of keyframes soon after one another are the same: their number does not count. 0 without any.
  double sigma() const { return keyframes_ > 0 ? std::min(kLargest, std::sqrt(keyframes_ / information_)) : 0; }

 private:
  static constexpr double kLargest = 0.5;

  double information_ = 0;
  int keyframes_ = 0;
};

}  // namespace fbvins
