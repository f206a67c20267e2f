// SPDX-License-Identifier: Apache-2.0
#include "fbvins/core/median.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/time.hpp"

namespace fbvins {
namespace median_test {

TEST(Median, IsTheMiddleOrTheUpperOfTwo) {
  EXPECT_EQ(median_of(std::vector<double>{}), 0);
  EXPECT_EQ(median_of(std::vector<double>{7}), 7);
  EXPECT_EQ(median_of(std::vector<double>{3, 1, 2}), 2);
  EXPECT_EQ(median_of(std::vector<double>{4, 1, 3, 2}), 3);
  EXPECT_EQ(median_of(std::vector<Duration>{{30}, {10}, {20}}), Duration{20});
}

TEST(Median, OfACopyKeepsTheOrder) {
  const std::vector<double> values{3, 1, 2};
  EXPECT_EQ(median_of(values), 2);
  EXPECT_EQ(values, (std::vector<double>{3, 1, 2}));
}

}  // namespace median_test
}  // namespace fbvins
