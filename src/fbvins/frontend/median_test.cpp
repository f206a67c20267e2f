// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/median.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace {

double median_of(std::vector<double> numbers) { return median(numbers); }

TEST(Median, IsTheMiddleOrTheUpperOfTwo) {
  EXPECT_EQ(median_of({}), 0);
  EXPECT_EQ(median_of({7}), 7);
  EXPECT_EQ(median_of({3, 1, 2}), 2);
  EXPECT_EQ(median_of({4, 1, 3, 2}), 3);
}

TEST(TypicalDepth, IgnoresTooFewDepths) {
  TypicalDepth depth;
  std::vector<double> few(9, 0.5), enough(10, 0.25);
  depth.update(few);
  EXPECT_EQ(depth.inverse_depth(), 0);
  depth.update(enough);
  EXPECT_EQ(depth.inverse_depth(), 0.25);
  depth.update(few);
  EXPECT_EQ(depth.inverse_depth(), 0.25);
}

}  // namespace
}  // namespace fbvins
