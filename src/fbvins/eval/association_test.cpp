// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/association.hpp"

#include <gtest/gtest.h>

#include "tests/support/eval_test_trajectories.hpp"

namespace fbvins {
namespace association_test {

constexpr std::int64_t kMs = 1'000'000;

Trajectory<AnyWorld> at_ms(std::initializer_list<std::int64_t> stamps) {
  Trajectory<AnyWorld> trajectory;
  for (std::int64_t ms : stamps) trajectory.push_back({Time{ms * kMs}, {Quat::Identity(), Vec3(static_cast<double>(ms), 0, 0)}});
  return trajectory;
}

TEST(Association, NearestWithinTheLimit) {
  const auto pairs = associate(at_ms({0, 100, 200, 300}), at_ms({108, 195, 260}), {});
  ASSERT_EQ(pairs.size(), 2u) << "260 ms is 40 ms from any truth";
  EXPECT_EQ(pairs[0].truth.t.ns, 100 * kMs);
  EXPECT_EQ(pairs[1].truth.t.ns, 200 * kMs);
}

TEST(Association, LimitItselfStillCounts) {
  EXPECT_EQ(associate(at_ms({0, 100}), at_ms({110}), {}).size(), 1u);
  EXPECT_EQ(associate(at_ms({0, 100}), at_ms({90}), {}).size(), 1u);
  EXPECT_EQ(associate(at_ms({0, 100}), at_ms({111}), {}).size(), 0u);
}

TEST(Association, EarlierOfTwoEquallyNear) {
  const auto pairs = associate(at_ms({0, 10}), at_ms({5}), {});
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].truth.t.ns, 0);
}

TEST(Association, SparseTruthIsWalkedInsteadOfTheEstimate) {
  const auto pairs = associate(at_ms({0, 1000}), at_ms({0, 5, 500, 995, 1001}), {});
  ASSERT_EQ(pairs.size(), 2u) << "one pair for each true pose, not for each estimate near one";
  EXPECT_EQ(pairs[1].estimate.t.ns, 1001 * kMs);
  EXPECT_EQ(pairs[1].truth.t.ns, 1000 * kMs);
}

TEST(Association, OrderInTheFileDoesNotMatter) {
  const auto pairs = associate(at_ms({300, 0, 200, 100}), at_ms({200, 0}), {});
  ASSERT_EQ(pairs.size(), 2u);
  EXPECT_LT(pairs[0].estimate.t, pairs[1].estimate.t);
}

TEST(Association, InterpolationHitsTheStampAndRefusesHoles) {
  AssociationOptions options;
  options.method = AssociationMethod::interpolate_truth;
  Trajectory<AnyWorld> truth = at_ms({0, 100, 1000});
  truth[1].T.q = so3_exp(Vec3(0, 0, 0.4));
  const auto pairs = associate(truth, at_ms({-5, 25, 100, 500, 1000, 1005}), options);
  ASSERT_EQ(pairs.size(), 3u) << "outside the truth, and inside its hole of 0.9 s, there is no pair";
  EXPECT_NEAR(pairs[0].truth.T.p.x(), 25, 1e-9);
  EXPECT_NEAR(so3_log(pairs[0].truth.T.q).z(), 0.1, 1e-12);
  EXPECT_EQ(pairs[1].truth.t.ns, 100 * kMs);
  EXPECT_EQ(pairs[2].truth.t.ns, 1000 * kMs);
}

TEST(Association, EmptyTrajectoriesGiveNoPairs) {
  EXPECT_TRUE(associate({}, at_ms({1}), {}).empty());
  EXPECT_TRUE(associate(at_ms({1}), {}, {}).empty());
}

}  // namespace association_test
}  // namespace fbvins
