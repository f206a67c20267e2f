// SPDX-License-Identifier: Apache-2.0
// Which images are examined for keypoints: tracks follow from image to image by alignment, which costs a third, and descriptors
// say no more of one image than of the next. One instance, one thread.
//
//   ExaminationPolicy policy(false);
//   if (policy.due(observed)) examine();
//   policy.pass(examined, observed_after);
#pragma once

#include <algorithm>

namespace fbvins {

class ExaminationPolicy {
 public:
  /// `every`: all images, as where tracks cannot be followed by alignment.
  explicit ExaminationPolicy(bool every) : every_(every) {}

  /// `observed`: tracks that alignment has found in this image.
  bool due(int observed) const { return every_ || since_ >= kMostBetween || observed < kShareObserved * observed_then_; }
  /// The image is done with: whether it was examined, and the tracks observed in it at the end.
  void pass(bool examined, int observed) {
    since_ = examined ? 0 : since_ + 1;
    if (examined)
      observed_then_ = std::max<double>(observed, observed_then_ / 2);  // what a dark image hides is missed for a while
  }

 private:
  /// Images passed over at most, and the share of the tracks of the last examined image that makes do.
  static constexpr int kMostBetween = 3;
  static constexpr double kShareObserved = 0.8;

  bool every_;
  int since_ = 0;
  double observed_then_ = 0;
};

}  // namespace fbvins
