// SPDX-License-Identifier: Apache-2.0
#include "fbvins/optim/robust_loss.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace robust_loss_test {

TEST(Huber, IsQuadraticInsideLinearOutsideAndSmoothBetween) {
  EXPECT_DOUBLE_EQ(huber(1.0, 2.0).cost, 0.5);
  EXPECT_DOUBLE_EQ(huber(1.0, 2.0).weight, 1.0);
  EXPECT_DOUBLE_EQ(huber(100.0, 2.0).cost, 2.0 * (10 - 1));
  EXPECT_DOUBLE_EQ(huber(100.0, 2.0).weight, 0.2);
  const double h = 1e-6;
  EXPECT_NEAR(huber(4 + h, 2.0).cost, huber(4 - h, 2.0).cost, 2e-6);
  EXPECT_NEAR(huber(4 + h, 2.0).weight, huber(4 - h, 2.0).weight, 1e-6);
}

}  // namespace robust_loss_test
}  // namespace fbvins
