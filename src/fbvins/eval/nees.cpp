// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/nees.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace fbvins {
namespace {

/// Two-sided 95 % bounds of chi-square: quantiles 0.025 and 0.975.
struct Bounds {
  double low, high;
  double holds(double value) const { return value >= low && value <= high ? 1.0 : 0.0; }
};
constexpr Bounds kChi2Of3 = {0.215795, 9.348404};
constexpr Bounds kChi2Of6 = {1.237344, 14.449375};

template <int N>
Result<double> squared(const Eigen::Matrix<double, N, 1>& error, const Eigen::Matrix<double, N, N>& covariance) {
  const Eigen::LLT<Eigen::Matrix<double, N, N>> llt(covariance);
  if (llt.info() != Eigen::Success || !covariance.allFinite())
    return Error{ErrorCode::invalid_argument, "the covariance is not positive definite"};
  return llt.matrixL().solve(error).squaredNorm();
}

}  // namespace

Result<PoseNees> pose_nees(const Vec6& error, const Mat6& covariance) {
  const auto pose = squared<6>(error, covariance);
  if (!pose) return pose.error();  // its diagonal blocks are positive definite when it is
  const auto position = squared<3>(error.head<3>(), covariance.topLeftCorner<3, 3>());
  const auto orientation = squared<3>(error.tail<3>(), covariance.bottomRightCorner<3, 3>());
  if (!position) return position.error();
  if (!orientation) return orientation.error();
  return PoseNees{*position, *orientation, *pose};
}

NeesSummary nees(const std::vector<PosePair>& pairs, const std::vector<Mat6>& covariances, const Similarity& to_truth) {
  const Pose<AnyWorld, AnyWorld> back = Pose<AnyWorld, AnyWorld>{to_truth.q, to_truth.p}.inverse();
  NeesSummary sum;
  for (std::size_t i = 0; i < std::min(pairs.size(), covariances.size()); ++i) {
    const auto one = pose_nees(back * pairs[i].truth.T, pairs[i].estimate.T, covariances[i]);
    if (!one) {
      ++sum.unusable;
      continue;
    }
    ++sum.count;
    sum.mean.position += one->position;
    sum.mean.orientation += one->orientation;
    sum.mean.pose += one->pose;
    sum.share_within_95.position += kChi2Of3.holds(one->position);
    sum.share_within_95.orientation += kChi2Of3.holds(one->orientation);
    sum.share_within_95.pose += kChi2Of6.holds(one->pose);
  }
  if (sum.count == 0) return sum;
  for (PoseNees* figures : {&sum.mean, &sum.share_within_95}) {
    figures->position /= sum.count;
    figures->orientation /= sum.count;
    figures->pose /= sum.count;
  }
  return sum;
}

}  // namespace fbvins
