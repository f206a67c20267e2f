// SPDX-License-Identifier: Apache-2.0
#include "fbvins/core/hypotenuse.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace hypotenuse_test {

TEST(Hypotenuse, IsWithinALastBitOfTheLibrarys) {
  Rng random(7);
  for (int i = 0; i < 100'000; ++i) {
    const double a = random.uniform(-1, 1), b = random.uniform(-1, 1) * (i % 3 == 0 ? 1e-8 : 1);
    const double expected = std::hypot(a, b);
    EXPECT_NEAR(hypotenuse(a, b), expected, std::numeric_limits<double>::epsilon() * expected) << a << ' ' << b;
    EXPECT_EQ(hypotenuse(a, b), hypotenuse(b, -a));
  }
}

TEST(Hypotenuse, OfZerosAndOfPythagorasIsExact) {
  EXPECT_EQ(hypotenuse(0, 0), 0);
  EXPECT_EQ(hypotenuse(0, -2), 2);
  EXPECT_EQ(hypotenuse(3, -4), 5);
  EXPECT_EQ(hypotenuse(5e-9, 12e-9), 13e-9);
  EXPECT_EQ(hypotenuse(1, std::numeric_limits<double>::infinity()), std::numeric_limits<double>::infinity());
}

}  // namespace hypotenuse_test
}  // namespace fbvins
