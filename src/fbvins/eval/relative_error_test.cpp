// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/relative_error.hpp"

#include <gtest/gtest.h>

#include "tests/support/eval_test_trajectories.hpp"

namespace fbvins {
namespace relative_error_test {

/// Straight along x, 0.25 m and 0.25 s a step; the estimate is 2 % too long.
std::vector<PosePair> straight(int n) {
  std::vector<PosePair> pairs;
  for (int i = 0; i < n; ++i) {
    const Time t{250'000'000LL * i};
    pairs.push_back({{t, {Quat::Identity(), Vec3(0.25 * i, 0, 0)}}, {t, {Quat::Identity(), Vec3(0.255 * i, 0, 0)}}});
  }
  return pairs;
}

TEST(RelativeError, ScaleErrorShowsPerMetre) {
  for (bool all_pairs : {true, false}) {
    const RelativeErrors e = relative_errors(straight(41), {.unit = DeltaUnit::metres, .all_pairs = all_pairs});
    ASSERT_EQ(e.translation_m.size(), all_pairs ? 37u : 10u);
    for (double error : e.translation_m) EXPECT_NEAR(error, 0.02, 1e-12);
    for (double error : e.rotation_deg) EXPECT_NEAR(error, 0, 1e-9);
  }
}

TEST(RelativeError, SecondsCountTimeNotPath) {
  const RelativeErrors e = relative_errors(straight(41), {.unit = DeltaUnit::seconds, .delta = 2});
  ASSERT_EQ(e.translation_m.size(), 33u + 0u);
  for (double error : e.translation_m) EXPECT_NEAR(error, 0.04, 1e-12);
}

TEST(RelativeError, PathOfTheEstimateGivesOtherPieces) {
  RelativeErrorOptions options{.unit = DeltaUnit::metres, .delta = 1, .all_pairs = false, .path_of_truth = false};
  auto pairs = straight(41);
  for (PosePair& pair : pairs) pair.estimate.T.p *= 2;
  EXPECT_EQ(delta_pairs(pairs, options).size(), 20u);
  options.path_of_truth = true;
  EXPECT_EQ(delta_pairs(pairs, options).size(), 10u);
}

TEST(RelativeError, StandingStillIsNotAMetre) {
  auto pairs = straight(9);  // 2 m
  for (int i = 0; i < 20; ++i) {
    PosePair last = pairs.back();
    last.truth.t = last.estimate.t = last.truth.t + Duration{250'000'000};
    pairs.push_back(last);
  }
  const auto pieces = delta_pairs(pairs, {.unit = DeltaUnit::metres});
  ASSERT_EQ(pieces.size(), 5u);
  EXPECT_EQ(pieces.back(), std::make_pair(4, 8)) << "the first of the equally far poses";
}

TEST(RelativeError, DoesNotDependOnTheChoiceOfWorld) {
  const Trajectory<AnyWorld> truth = eval_test::flight(300);
  const Trajectory<AnyWorld> estimate = eval_test::noisy(truth, 0.01, 0.01, 8);
  const Pose<AnyWorld, AnyWorld> turn{so3_exp(Vec3(0.4, 0.5, -2)), Vec3(1, 2, 3)};
  std::vector<PosePair> pairs, turned;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    pairs.push_back({truth[i], estimate[i]});
    turned.push_back({truth[i], {estimate[i].t, turn * estimate[i].T}});
  }
  const RelativeErrors a = relative_errors(pairs, {}), b = relative_errors(turned, {});
  ASSERT_EQ(a.translation_m.size(), b.translation_m.size());
  ASSERT_GT(a.translation_m.size(), 100u);
  for (std::size_t i = 0; i < a.translation_m.size(); ++i) {
    EXPECT_NEAR(a.translation_m[i], b.translation_m[i], 1e-12);
    EXPECT_NEAR(a.rotation_deg[i], b.rotation_deg[i], 1e-6);
  }
}

TEST(RelativeError, TooShortGivesNothing) {
  EXPECT_TRUE(relative_errors(straight(3), {}).translation_m.empty());
  EXPECT_TRUE(relative_errors({}, {}).translation_m.empty());
}

}  // namespace relative_error_test
}  // namespace fbvins
