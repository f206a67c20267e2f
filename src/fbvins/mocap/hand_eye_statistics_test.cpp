// SPDX-License-Identifier: Apache-2.0
// Errors of the alignment and their covariance, over recordings.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "fbvins/core/angle.hpp"
#include "fbvins/mocap/hand_eye.hpp"
#include "fbvins/mocap/marker_faults.hpp"
#include "tests/support/hand_eye_scene.hpp"

namespace fbvins {
namespace hand_eye_statistics_test {

constexpr Time kStart{1'700'000'000'123'456'789};

/// Gaps, another body for a second, and a body that comes back turned by half a turn are in each of them.
TEST(HandEyeStatistics, TwentyRecordingsOfAMinute) {
  double nees = 0, squares_m = 0, worst_m = 0, worst_rad = 0, worst_s = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const test::ExactFlight flight(seed, 60);
    const test::MarkerRecording recording = test::record(flight, kStart, {}, seed);
    const auto found =
        align_hand_eye(inspect(recording.track).kept(recording.track), test::estimate_of(flight, kStart, {}, seed), {});
    ASSERT_TRUE(found.ok()) << seed << ": " << found.error().message;
    const Eigen::Matrix<double, 7, 1> e = test::error_of(found->calibration, recording.truth);
    nees += e.dot(test::covariance_of(*found).llt().solve(e)) / 20;
    squares_m += e.head<3>().squaredNorm() / 20;
    worst_m = std::max(worst_m, e.head<3>().norm());
    worst_rad = std::max(worst_rad, e.segment<3>(3).norm());
    worst_s = std::max(worst_s, std::abs(e(6)));
    ASSERT_EQ(found->faults.size(), 1u) << seed;
    EXPECT_EQ(found->faults[0].kind, MarkerFaultKind::flip);
    EXPECT_NEAR(found->faults[0].angle_rad, std::numbers::pi, 0.05);
  }
  EXPECT_LT(worst_rad * kDegreesPerRad, 0.1);
  EXPECT_LT(worst_s, 0.5e-3);
  EXPECT_LT(std::sqrt(squares_m), 2e-3);
  EXPECT_LT(worst_m, 4e-3) << "two millimetres are reached in most of them, not in all";
  EXPECT_GT(nees, 0.5 * 7);
  EXPECT_LT(nees, 2.0 * 7);
}

}  // namespace hand_eye_statistics_test
}  // namespace fbvins
