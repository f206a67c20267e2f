// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/nees.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "tests/support/eval_test_trajectories.hpp"

namespace fbvins {
namespace nees_test {

Mat6 some_covariance() {
  Rng rng(11);
  Mat6 a;
  for (int i = 0; i < 36; ++i) a(i) = rng.normal();
  Mat6 scale = Mat6::Identity();
  scale.topLeftCorner<3, 3>() *= 0.02;
  scale.bottomRightCorner<3, 3>() *= 0.005;
  return scale * (a * a.transpose() + Mat6::Identity()) * scale;
}

/// Estimates whose errors are drawn from the covariance, in a world turned against the truth's.
std::vector<PosePair> sampled(const Mat6& covariance, const Pose<AnyWorld, AnyWorld>& T_truth_estimate, int n) {
  const Mat6 L = covariance.llt().matrixL();
  Rng rng(12);
  std::vector<PosePair> pairs;
  for (const StampedPose<AnyWorld>& estimate : eval_test::flight(n)) {
    Vec6 e;
    for (int i = 0; i < 6; ++i) e(i) = rng.normal();
    e = L * e;
    pairs.push_back({{estimate.t, T_truth_estimate * estimate.T.boxplus(e.head<3>(), e.tail<3>())}, estimate});
  }
  return pairs;
}

TEST(Nees, ConsistentCovarianceGivesItsDegreesOfFreedom) {
  const Mat6 P = some_covariance();
  const Similarity S{1, so3_exp(Vec3(0, 0, 1.2)), Vec3(4, 5, 6)};
  const auto pairs = sampled(P, Pose<AnyWorld, AnyWorld>{S.q, S.p}, 4000);
  const NeesSummary s = nees(pairs, std::vector<Mat6>(pairs.size(), P), S);
  EXPECT_EQ(s.count, 4000);
  EXPECT_NEAR(s.mean.position, 3, 0.15);
  EXPECT_NEAR(s.mean.orientation, 3, 0.15);
  EXPECT_NEAR(s.mean.pose, 6, 0.2);
  EXPECT_NEAR(s.share_within_95.position, 0.95, 0.015);
  EXPECT_NEAR(s.share_within_95.orientation, 0.95, 0.015);
  EXPECT_NEAR(s.share_within_95.pose, 0.95, 0.015);
}

TEST(Nees, OverconfidenceShows) {
  const Mat6 P = some_covariance();
  const auto pairs = sampled(P, {}, 1000);
  const NeesSummary s = nees(pairs, std::vector<Mat6>(pairs.size(), Mat6(P / 4)), {});
  EXPECT_NEAR(s.mean.pose, 24, 1.5);
  EXPECT_LT(s.share_within_95.pose, 0.5);
}

TEST(Nees, AnInvalidCovarianceIsCountedNotUsed) {
  const Mat6 P = some_covariance();
  const auto pairs = sampled(P, {}, 3);
  Mat6 nan = P;
  nan(0, 0) = std::nan("");
  const NeesSummary s = nees(pairs, {P, Mat6::Zero(), nan}, {});
  EXPECT_EQ(s.count, 1);
  EXPECT_EQ(s.unusable, 2);
  EXPECT_FALSE(pose_nees(pairs[0].truth.T, pairs[0].estimate.T, -P));
}

}  // namespace nees_test
}  // namespace fbvins
