// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace fbvins {
namespace statistics_test {

TEST(Statistics, FiveFiguresOfAKnownList) {
  const ErrorStatistics s = statistics_of({4, 1, 2, 3});
  EXPECT_EQ(s.count, 4);
  EXPECT_DOUBLE_EQ(s.max, 4);
  EXPECT_DOUBLE_EQ(s.mean, 2.5);
  EXPECT_DOUBLE_EQ(s.median, 2.5) << "mean of the middle two";
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(7.5));
  EXPECT_DOUBLE_EQ(s.std, std::sqrt(1.25)) << "over the population";
}

TEST(Statistics, OddCountTakesTheMiddle) { EXPECT_DOUBLE_EQ(statistics_of({9, 1, 5}).median, 5); }

TEST(Statistics, NothingGivesZeroAndCountSaysSo) {
  const ErrorStatistics s = statistics_of({});
  EXPECT_EQ(s.count, 0);
  EXPECT_EQ(s.rmse, 0);
}

TEST(Statistics, SpreadOfLargeNumbersDoesNotCancel) {
  EXPECT_NEAR(statistics_of({1e8, 1e8 + 1, 1e8 + 2}).std, std::sqrt(2.0 / 3.0), 1e-9);
}

TEST(Statistics, PercentileIsLinearBetweenNeighbours) {
  EXPECT_DOUBLE_EQ(percentile({10, 20, 30, 40, 50}, 0.5), 30);
  EXPECT_DOUBLE_EQ(percentile({0, 10}, 0.25), 2.5);
  EXPECT_DOUBLE_EQ(percentile({7}, 0.99), 7);
  EXPECT_DOUBLE_EQ(percentile({1, 2, 3}, 1.0), 3);
}

}  // namespace statistics_test
}  // namespace fbvins
