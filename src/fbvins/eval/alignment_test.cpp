// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/alignment.hpp"

#include <gtest/gtest.h>

#include "fbvins/eval/evaluation.hpp"
#include "tests/support/eval_test_trajectories.hpp"

namespace fbvins {
namespace alignment_test {

using eval_test::flight;
using eval_test::noisy;

/// The flight seen from a world turned by q, shifted by p and shrunk.
std::vector<PosePair> moved_pairs(const Quat& q, const Vec3& p, double scale) {
  std::vector<PosePair> pairs;
  for (const StampedPose<AnyWorld>& truth : flight(200)) {
    const Similarity inverse{1 / scale, q.conjugate(), Vec3(-(q.conjugate() * p) / scale)};
    pairs.push_back({truth, {truth.t, inverse * truth.T}});
  }
  return pairs;
}

double cost(const std::vector<PosePair>& pairs, const Similarity& s) {
  double sum = 0;
  for (double e : absolute_errors_m(apply(s, pairs))) sum += e * e;
  return sum;
}

TEST(Alignment, RecoversRotationShiftAndScale) {
  const Quat q = so3_exp(Vec3(0.5, -1.1, 2.0));
  const Vec3 p(3, -7, 0.5);
  const auto sim3 = align(moved_pairs(q, p, 2.5), Alignment::sim3);
  ASSERT_TRUE(sim3);
  EXPECT_NEAR(sim3->scale, 2.5, 1e-12);
  EXPECT_LT(sim3->q.angularDistance(q), 1e-7);
  EXPECT_LT((sim3->p - p).norm(), 1e-10);
  const auto pairs = moved_pairs(q, p, 1.0);
  const auto se3 = align(pairs, Alignment::se3);
  ASSERT_TRUE(se3);
  EXPECT_EQ(se3->scale, 1.0);
  EXPECT_LT(cost(pairs, *se3), 1e-18);
}

TEST(Alignment, YawKeepsGravity) {
  const auto tilted = moved_pairs(so3_exp(Vec3(0.3, 0, 0)), Vec3::Zero(), 1.0);
  const auto yaw = align(tilted, Alignment::yaw);
  ASSERT_TRUE(yaw);
  EXPECT_LT((yaw->q * Vec3::UnitZ() - Vec3::UnitZ()).norm(), 1e-15);
  EXPECT_GT(cost(tilted, *yaw), 1.0) << "a tilt is an error that yaw-only alignment must not hide";
  const auto turned = moved_pairs(so3_exp(Vec3(0, 0, -2.2)), Vec3(1, 2, 3), 1.0);
  const auto exact = align(turned, Alignment::yaw);
  ASSERT_TRUE(exact);
  EXPECT_LT(cost(turned, *exact), 1e-18);
}

TEST(Alignment, OfTheStartLeavesWhatComesLaterAsItIs) {
  const Quat heading = so3_exp(Vec3(0, 0, 2.8));
  auto pairs = moved_pairs(heading, Vec3(4, 5, 6), 1.0);
  const Time begin = pairs.front().truth.t;
  std::size_t later = 0;
  for (PosePair& pair : pairs) {
    if ((pair.truth.t - begin).seconds() <= 1) continue;
    pair.estimate.T.p += Vec3(0, 0, 0.1);
    ++later;
  }
  ASSERT_GT(later, 0u);
  ASSERT_LT(later, pairs.size());
  const auto start = align_start(pairs);
  ASSERT_TRUE(start);
  EXPECT_LT(start->q.angularDistance(heading), 1e-12);
  EXPECT_NEAR(cost(pairs, *start), 0.01 * static_cast<double>(later), 1e-9);
  EXPECT_FALSE(align_start({}));
  EXPECT_FALSE(align_start_levelled({}));
}

TEST(Alignment, AConstantTiltOfTheTruthIsFound) {
  const Quat tilted(Eigen::AngleAxisd(0.01, Vec3(0.6, 0.8, 0)));
  std::vector<PosePair> pairs = moved_pairs(Quat(Eigen::AngleAxisd(1.1, Vec3::UnitZ())), Vec3(3, -2, 1), 1.0);
  for (PosePair& pair : pairs) pair.truth.T = Similarity{1, tilted, Vec3(0.2, 0, 0)} * pair.truth.T;
  const auto start = align_start_levelled(pairs);
  ASSERT_TRUE(start);
  EXPECT_NEAR(start->truth_tilt_rad, 0.01, 1e-12);
  EXPECT_LT(cost(pairs, start->to_truth), 1e-20);
  EXPECT_GT(cost(pairs, *align_start(pairs)), 1e-3);
}

TEST(Alignment, IsAMinimumOfItsOwnFamily) {
  auto pairs = moved_pairs(so3_exp(Vec3(0.1, 0.2, 1)), Vec3(1, 1, 1), 1.3);
  Rng rng(5);
  for (PosePair& pair : pairs) pair.estimate.T.p += eval_test::normal3(rng, 0.05);
  for (Alignment kind : {Alignment::yaw, Alignment::se3, Alignment::sim3}) {
    const auto best = align(pairs, kind);
    ASSERT_TRUE(best);
    const double least = cost(pairs, *best);
    for (int k = 0; k < 50; ++k) {
      Similarity other = *best;
      Vec3 turn = eval_test::normal3(rng, 1e-3);
      if (kind == Alignment::yaw) turn.head<2>().setZero();
      other.q = (other.q * so3_exp(turn)).normalized();
      other.p += eval_test::normal3(rng, 1e-3);
      if (kind == Alignment::sim3) other.scale *= 1 + 1e-3 * rng.normal();
      EXPECT_GE(cost(pairs, other), least) << to_string(kind);
    }
  }
}

TEST(Alignment, MirrorIsNotARotation) {
  auto pairs = moved_pairs(Quat::Identity(), Vec3::Zero(), 1.0);
  for (PosePair& pair : pairs) pair.estimate.T.p.x() *= -1;
  const auto se3 = align(pairs, Alignment::se3);
  ASSERT_TRUE(se3);
  EXPECT_NEAR(se3->q.toRotationMatrix().determinant(), 1.0, 1e-12);
  EXPECT_GT(cost(pairs, *se3), 1.0);
}

TEST(Alignment, SaysWhenPositionsDoNotDetermineIt) {
  auto still = moved_pairs(Quat::Identity(), Vec3::Zero(), 1.0);
  for (PosePair& pair : still) pair.estimate.T.p.setZero();
  ASSERT_FALSE(align(still, Alignment::se3));
  EXPECT_NE(align(still, Alignment::se3).error().message.find("two directions"), std::string::npos);
  EXPECT_TRUE(align(still, Alignment::yaw));
  still.resize(2);
  EXPECT_FALSE(align(still, Alignment::yaw));
  EXPECT_TRUE(align(still, Alignment::none));
}

TEST(Alignment, NamesRoundTrip) {
  for (Alignment kind : {Alignment::none, Alignment::yaw, Alignment::se3, Alignment::sim3})
    EXPECT_EQ(alignment_from_string(to_string(kind)), kind);
  EXPECT_FALSE(alignment_from_string("SE4"));
}

}  // namespace alignment_test
}  // namespace fbvins
