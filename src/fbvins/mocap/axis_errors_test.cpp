// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/axis_errors.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace axis_errors_test {

/// The paper's flight: hovers for 3 s, 0.6 m forward and 0.3 m to the left in 4 s, hovers for 3 s.
Trajectory<W> mission(const Vec3& offset, const Vec3& end_error) {
  Trajectory<W> out;
  for (int i = 0; i <= 1000; ++i) {
    const double u = std::clamp((i * 0.01 - 3) / 4, 0.0, 1.0);
    out.push_back({Time{10'000'000LL * i}, {Quat::Identity(), Vec3(offset + u * (Vec3(0.6, 0.3, 0) + end_error))}});
  }
  return out;
}

TEST(AxisErrors, AreWhatTheFlightMissesItsTargetBy) {
  const Trajectory<W> truth = mission(Vec3(0, 0, 0.6), Vec3(0.02, -0.01, 0.03)),
                      estimate = mission(Vec3(0.001, 0, 0.6), Vec3::Zero());
  const auto hovers = find_hovers(truth);
  ASSERT_TRUE(hovers.has_value());
  EXPECT_NEAR(hovers->first.from.seconds(), 0.1, 0.05);
  EXPECT_NEAR(hovers->first.to.seconds(), 3.1, 0.15);
  EXPECT_NEAR(hovers->last.from.seconds(), 7.15, 0.15);
  const auto errors = axis_errors(truth, estimate, {Time{500'000'000}, Time{2'000'000'000}},
                                  {Time{8'000'000'000}, Time{9'500'000'000}}, Vec3(0.6, 0.3, 0));
  ASSERT_TRUE(errors.ok());
  EXPECT_LT((errors->axial_error() - Vec3(0.02, -0.01, 0.03)).norm(), 1e-9);
  EXPECT_LT((errors->estimate_difference() - Vec3(0.6, 0.3, 0)).norm(), 1e-9);
  EXPECT_LT((errors->truth_start - Vec3(0, 0, 0.6)).norm(), 1e-9);
}

TEST(AxisErrors, NeedBothInEverySpan) {
  const Trajectory<W> truth = mission(Vec3::Zero(), Vec3::Zero());
  const auto errors = axis_errors(truth, truth, {Time{0}, Time{1}}, {Time{20'000'000'000}, Time{21'000'000'000}});
  ASSERT_FALSE(errors.ok());
  EXPECT_EQ(errors.error().message, "there is no motion capture at the end, 20.000 s to 21.000 s");
  Trajectory<W> moving;
  for (int i = 0; i < 1000; ++i) moving.push_back({Time{10'000'000LL * i}, {Quat::Identity(), Vec3(0.01 * i, 0, 0)}});
  EXPECT_FALSE(find_hovers(moving).has_value());
}

}  // namespace axis_errors_test
}  // namespace fbvins
