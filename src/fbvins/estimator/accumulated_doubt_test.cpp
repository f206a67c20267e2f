// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/accumulated_doubt.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace fbvins {
namespace accumulated_doubt_test {

Pose<G, B> at(double x_m) { return {Quat::Identity(), Vec3(x_m, 0, 0)}; }

TEST(AccumulatedDoubt, ATurnMovesWhatIsFarFromWhereItBegan) {
  AccumulatedDoubt doubt;
  doubt.add(at(2), Vec3(0, 0, 0.02), Vec3::Zero());
  const double sigma = 0.02 * std::sqrt(2);
  EXPECT_NEAR(std::sqrt(doubt.covariance(at(2))(5, 5)), sigma, 1e-12);
  EXPECT_LT(doubt.covariance(at(2))(1, 1), 1e-12);
  EXPECT_NEAR(std::sqrt(doubt.covariance(at(12))(1, 1)), 10 * sigma, 1e-9);
  EXPECT_NEAR(std::sqrt(doubt.velocity_covariance(Vec3(3, 0, 0))(1, 1)), 3 * sigma, 1e-9);
  EXPECT_FALSE(doubt.large());
}

TEST(AccumulatedDoubt, OppositeTurnsLeaveTheirSquares) {
  AccumulatedDoubt doubt;
  for (const double turn : {0.04, -0.04}) doubt.add(at(0), Vec3(0, 0, turn), Vec3::Zero());
  EXPECT_NEAR(doubt.covariance(at(0))(5, 5), 2 * 0.04 * 0.04, 1e-12);
  EXPECT_FALSE(doubt.large());
}

TEST(AccumulatedDoubt, IsLargeBeyondThreeDegreesOrTenCentimetres) {
  for (const auto& [turn_rad, shift_m, large] : {std::tuple{0.05, 0.09, false}, {0.055, 0.0, true}, {0.0, 0.11, true}}) {
    AccumulatedDoubt doubt;
    for (int k = 0; k < 2; ++k) doubt.add(at(0), Vec3(0, turn_rad / 2, 0), Vec3(0, shift_m / 2, 0));
    EXPECT_EQ(doubt.large(), large);
    doubt.clear();
    EXPECT_FALSE(doubt.large());
    EXPECT_TRUE(doubt.covariance(at(5)).isZero(0));
  }
}

TEST(AccumulatedDoubt, APositionThatMayHaveMovedIsUncertainInEachDirection) {
  AccumulatedDoubt doubt;
  doubt.add_position(0.1);
  EXPECT_TRUE((doubt.covariance(at(3)).topLeftCorner<3, 3>() - 0.01 * Mat3::Identity()).isZero(1e-12));
  EXPECT_TRUE((doubt.covariance(at(3)).bottomRightCorner<3, 3>().isZero(0)));
}

}  // namespace accumulated_doubt_test
}  // namespace fbvins
