// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "fbvins/core/ids.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/core/time.hpp"

namespace fbvins {
namespace core_test {

TEST(Time, DifferenceIsExactForEpochStamps) {
  const Time a{1'403'636'584'763'555'584}, b{1'403'636'584'813'555'456};
  EXPECT_EQ((b - a).ns, 49'999'872);
  EXPECT_EQ(a + (b - a), b);
}

TEST(Time, SecondsRoundToTheNearestNanosecond) {
  EXPECT_EQ(Duration::from_seconds(0.005).ns, 5'000'000);
  EXPECT_EQ(Duration::from_seconds(-0.005).ns, -5'000'000);
}

TEST(Ids, DefaultIsInvalid) {
  EXPECT_FALSE(FrameId{}.valid());
  EXPECT_TRUE(FrameId{0}.valid());
}

TEST(Result, HoldsValueOrError) {
  const Result<int> good = 3;
  const Result<int> bad = Error{ErrorCode::not_found, "no file"};
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(*good, 3);
  ASSERT_FALSE(bad.ok());
  EXPECT_EQ(bad.error().message, "no file");
}

TEST(Rng, SameSeedGivesTheSameNumberAnotherSeedAnother) {
  Rng a(42), b(42), c(43);
  const auto first = a.next_u32();
  EXPECT_EQ(first, b.next_u32());
  EXPECT_NE(first, c.next_u32());
}

TEST(Rng, IsPcg32) {
  Rng rng(42, 54);  // seed and stream of the demonstration that its author published with its numbers
  for (const std::uint32_t number : {0xa15c02b7u, 0x7b47f409u, 0xba1d3330u, 0x83d2f293u, 0xbfa4784bu, 0xcbed606eu})
    EXPECT_EQ(rng.next_u32(), number);
}

TEST(Rng, NormalHasUnitVariance) {
  Rng rng(7);
  double sum = 0, sum2 = 0;
  const int n = 200000;
  for (int i = 0; i < n; ++i) {
    const double x = rng.normal();
    sum += x;
    sum2 += x * x;
  }
  EXPECT_NEAR(sum / n, 0, 0.01);
  EXPECT_NEAR(sum2 / n, 1, 0.02);
}

}  // namespace core_test
}  // namespace fbvins
