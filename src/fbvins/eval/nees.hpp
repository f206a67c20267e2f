// SPDX-License-Identifier: Apache-2.0
// Consistency: are the errors as large as the estimator's own covariances say? The normalised
// estimation error squared, e^T P^-1 e, has mean 3 for a position or an orientation and 6 for a
// pose when they are; larger means overconfident (Bar-Shalom, Li, Kirubarajan, 2001, 5.4).
// Pure functions, any thread.
//
//   NeesSummary s = nees(pairs, covariances, alignment);   // s.position near 3 is consistent
#pragma once

#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/eval/alignment.hpp"

namespace fbvins {

struct PoseNees {
  double position = 0;     ///< mean 3 when consistent
  double orientation = 0;  ///< mean 3
  double pose = 0;         ///< mean 6
};

struct NeesSummary {
  int count = 0;     ///< poses that entered
  int unusable = 0;  ///< poses whose covariance is not positive definite
  PoseNees mean;
  /// Share of the poses inside the two-sided 95 % bounds of chi-square with 3, 3 and 6 degrees of freedom.
  PoseNees share_within_95;
};

/// Error of one pose against its covariance, of (dp in W [m], dtheta in B [rad]) with
/// truth = estimate.boxplus(dp, dtheta), both in the estimate's world. An error for a covariance
/// that is not positive definite.
Result<PoseNees> pose_nees(const Vec6& error, const Mat6& covariance);
template <class Frame>
Result<PoseNees> pose_nees(const Pose<Frame, B>& truth, const Pose<Frame, B>& estimate, const Mat6& covariance) {
  Vec6 error;
  error << truth.p - estimate.p, so3_log(estimate.q.conjugate() * truth.q);
  return pose_nees(error, covariance);
}

/// Over a trajectory: covariances[i] belongs to pairs[i]; `to_truth` is the alignment of the estimate,
/// which is undone on the truth because covariances live in the estimate's world. Its scale is ignored.
NeesSummary nees(const std::vector<PosePair>& pairs, const std::vector<Mat6>& covariances, const Similarity& to_truth);

}  // namespace fbvins
