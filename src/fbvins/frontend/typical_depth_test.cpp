// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/typical_depth.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace typical_depth_test {

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

}  // namespace typical_depth_test
}  // namespace fbvins
