// SPDX-License-Identifier: Apache-2.0
// Decides which images are examined, that is, have keypoints extracted and matched. Between them tracks are followed by patch
// alignment, which costs a third. One instance, one thread.
//
//   ExaminationPolicy policy(false);
//   if (policy.due(observed)) examine();
//   policy.pass(examined, observed_after);
#pragma once

#include <algorithm>

namespace fbvins {

class ExaminationPolicy {
 public:
  /// `every`: examine all images, for tracks that are not followed by alignment.
  explicit ExaminationPolicy(bool every) : every_(every) {}

  /// `observed`: tracks that alignment has found in this image.
  bool due(int observed) const { return every_ || since_ >= kMostBetween || observed < kShareObserved * observed_then_; }
  /// To be called after each image: whether it was examined, and the tracks observed in it at the end.
  void pass(bool examined, int observed) {
    since_ = examined ? 0 : since_ + 1;
    if (examined)
      observed_then_ = std::max<double>(observed, observed_then_ / 2);  // a dark image does not lower it to zero at once
  }

 private:
  /// Most images in a row that are not examined, and the share of the last examined image's tracks below which one is.
  static constexpr int kMostBetween = 3;
  static constexpr double kShareObserved = 0.8;

  bool every_;
  int since_ = 0;
  double observed_then_ = 0;
};

}  // namespace fbvins
