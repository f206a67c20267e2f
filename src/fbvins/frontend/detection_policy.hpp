// SPDX-License-Identifier: Apache-2.0
// Decides in which images keypoints are detected and matched. Between them tracks are followed by patch
// alignment, which costs a third. One instance, one thread.
//
//   DetectionPolicy policy;
//   if (policy.due(observed)) detect();
//   policy.pass(detected, observed_after);
#pragma once

#include <algorithm>

namespace fbvins {

class DetectionPolicy {
 public:
  /// `observed`: tracks that alignment has found in this image.
  bool due(int observed) const { return since_ >= kMostBetween || observed < kShareObserved * observed_then_; }
  /// To be called after each image: whether keypoints were detected in it, and the tracks observed in it at the end.
  void pass(bool detected, int observed) {
    since_ = detected ? 0 : since_ + 1;
    if (detected)
      observed_then_ = std::max<double>(observed, observed_then_ / 2);  // a dark image does not lower it to zero at once
  }
  /// Tracks that were added to those of the last image with keypoints, afterwards.
  void add(int tracks) { observed_then_ += tracks; }

 private:
  /// Most images in a row without, and the share of the tracks of the last one with, below which there is another.
  static constexpr int kMostBetween = 3;
  static constexpr double kShareObserved = 0.8;

  int since_ = 0;
  double observed_then_ = 0;
};

}  // namespace fbvins
