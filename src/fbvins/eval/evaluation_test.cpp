// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/evaluation.hpp"

#include <gtest/gtest.h>

#include <type_traits>

#include "tests/support/eval_test_trajectories.hpp"

namespace fbvins {
namespace evaluation_test {

using eval_test::flight;
using eval_test::noisy;

static_assert(!std::is_convertible_v<Trajectory<M>, Trajectory<W>>, "odometry and map do not mix");

TEST(Evaluation, ErrorsOfAKnownNoise) {
  const Trajectory<AnyWorld> truth = flight(2000);
  const auto e = evaluate(truth, noisy(truth, 0.02, 0.01, 3), {});
  ASSERT_TRUE(e);
  EXPECT_EQ(e->pairs, 2000);
  EXPECT_NEAR(e->absolute_m.rmse, 0.02 * std::sqrt(3.0), 0.001);
  EXPECT_NEAR(e->absolute_rotation_deg.rmse, 0.01 * std::sqrt(3.0) * 57.29578, 0.05);
  EXPECT_GT(e->per_metre_m.count, 1000);
  EXPECT_EQ(e->per_second_m.count, 1982) << "all pairs 1 s apart, and the two within 10 % of it at the end";
}

TEST(Evaluation, OdometryAndMapAreEvaluatedAlikeAgainstTheSameTruth) {
  Trajectory<W> truth;
  Trajectory<M> estimate;
  for (const StampedPose<AnyWorld>& pose : flight(300)) truth.push_back({pose.t, {pose.T.q, pose.T.p}});
  for (const StampedPose<AnyWorld>& pose : noisy(flight(300), 0.02, 0.01, 3)) estimate.push_back({pose.t, {pose.T.q, pose.T.p}});
  const auto in_map = evaluate(truth, estimate, {}), in_any = evaluate(flight(300), noisy(flight(300), 0.02, 0.01, 3), {});
  ASSERT_TRUE(in_map && in_any);
  EXPECT_EQ(in_map->absolute_m.rmse, in_any->absolute_m.rmse);
  EXPECT_EQ(in_map->per_metre_deg.rmse, in_any->per_metre_deg.rmse);
}

TEST(Evaluation, NothingInCommonIsAnError) {
  Trajectory<AnyWorld> late = flight(10);
  for (StampedPose<AnyWorld>& pose : late) pose.t = pose.t + Duration{1'000'000'000'000};
  const auto e = evaluate(flight(10), late, {});
  ASSERT_FALSE(e);
  EXPECT_NE(e.error().message.find("clock"), std::string::npos);
}

TEST(Evaluation, FiguresOfAKnownShift) {
  // Without alignment, one metre off all the way: no relative error, and the path is the truth's own.
  EvaluationOptions options;
  options.alignment = Alignment::none;
  const Trajectory<AnyWorld> truth = flight(100);
  Trajectory<AnyWorld> estimate = truth;
  for (StampedPose<AnyWorld>& pose : estimate) pose.T.p += Vec3(0, 1, 0);
  const auto e = evaluate(truth, estimate, options);
  ASSERT_TRUE(e);
  EXPECT_NEAR(e->absolute_m.rmse, 1, 1e-12);
  EXPECT_NEAR(e->absolute_m.std, 0, 1e-9);
  EXPECT_NEAR(e->per_second_m.max, 0, 1e-9);
  double path_m = 0, excursion_m = 0;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    path_m += (truth[i].T.p - truth[i - 1].T.p).norm();
    excursion_m = std::max(excursion_m, (truth[i].T.p - truth[0].T.p).norm());
  }
  EXPECT_DOUBLE_EQ(e->truth_path_m, path_m);
  EXPECT_NEAR(e->largest_excursion_m, excursion_m, 1e-12);
}

TEST(Evaluation, ATruthWithAGapIsSaid) {
  const Trajectory<AnyWorld> estimate = flight(400);
  Trajectory<AnyWorld> truth;
  const double step_s = (estimate[1].t - estimate[0].t).seconds();
  for (std::size_t i = 0; i < 400; ++i)
    if (i < 100 || i >= 300) {
      truth.push_back(estimate[i]);
      if (i >= 300) truth.back().T.p += Vec3(0, 0.3, 0);  // so far the estimate has drifted
    }
  const auto e = evaluate(truth, estimate, {});
  ASSERT_TRUE(e);
  EXPECT_NEAR(e->longest_truth_gap_s, 201 * step_s, 1e-6);
  EXPECT_NEAR(e->truth_share, 1 - 201.0 / 399, 1e-6);
  ASSERT_TRUE(e->end_drift_m.has_value());
  EXPECT_NEAR(*e->end_drift_m, 0.3, 1e-6);
  EXPECT_NEAR(e->per_second_m.max, 0, 1e-9) << "not across the gap";
  const auto whole = evaluate(estimate, estimate, {});
  EXPECT_EQ(whole->truth_share, 1);
  EXPECT_FALSE(whole->end_drift_m.has_value());
}

}  // namespace evaluation_test
}  // namespace fbvins
