// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/numbers.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace numbers_test {

TEST(Numbers, SecondsKeepEveryNanosecond) {
  EXPECT_EQ(parse_seconds("1403636584.763555584")->ns, 1403636584763555584);
  EXPECT_EQ(parse_seconds("1.403636584763555584e+09")->ns, 1403636584763555584);
  EXPECT_EQ(parse_seconds("1.403636584763555584E9")->ns, 1403636584763555584);
  EXPECT_EQ(parse_seconds("1403636584763555584e-9")->ns, 1403636584763555584);
  EXPECT_EQ(parse_seconds("0.000000001")->ns, 1);
  EXPECT_EQ(parse_seconds(".5")->ns, 500'000'000);
  EXPECT_EQ(parse_seconds("5.")->ns, 5'000'000'000);
  EXPECT_EQ(parse_seconds("0")->ns, 0);
  EXPECT_EQ(parse_seconds("0.0000000000000000000000000000001")->ns, 0);
  EXPECT_EQ(parse_seconds("0000000000000000000000000000012.5")->ns, 12'500'000'000);
}

TEST(Numbers, SecondsRoundToTheNearestNanosecond) {
  EXPECT_EQ(parse_seconds("1.0000000004999")->ns, 1'000'000'000);
  EXPECT_EQ(parse_seconds("1.0000000005")->ns, 1'000'000'001);
  EXPECT_EQ(parse_seconds("1403636584.76355558449999999999")->ns, 1403636584763555584);
}

TEST(Numbers, SecondsRefuseWhatIsNoStamp) {
  for (const char* text :
       {"", ".", "e9", "1e", "1e+", "-1", "+1", "1.2.3", "1e99", "9e9", "nan", "inf", "0x10", "1 2", "1e99999999999", "12a"})
    EXPECT_FALSE(parse_seconds(text)) << text;
}

TEST(Numbers, SecondsComeBackFromTheirText) {
  Rng rng(11);
  for (int i = 0; i < 5000; ++i) {
    const auto ns =
        static_cast<std::int64_t>((std::uint64_t{rng.next_u32()} << 32u | rng.next_u32()) % kLatestStamp_ns) >> rng.below(62);
    EXPECT_EQ(parse_seconds(format_seconds(Time{ns})), Time{ns});
  }
  EXPECT_EQ(format_seconds(Time{-1'500'000'000}), "-1.500000000");
}

TEST(Numbers, NanosecondsAreWholeAndInRange) {
  EXPECT_EQ(parse_nanoseconds(" 1403636584763555584\r")->ns, 1403636584763555584);
  EXPECT_EQ(parse_nanoseconds("0")->ns, 0);
  for (const char* text : {"", "-1", "1.5", "1e9", "4000000000000000001", "99999999999999999999", "12x"})
    EXPECT_FALSE(parse_nanoseconds(text)) << text;
}

TEST(Numbers, DoublesAreTheWholeField) {
  EXPECT_EQ(parse_double(" -1.5e-3 "), -1.5e-3);
  EXPECT_EQ(parse_double("+2"), 2.0);
  EXPECT_TRUE(std::isnan(*parse_double("nan")));
  EXPECT_TRUE(std::isinf(*parse_double("-inf")));
  for (const char* text : {"", " ", "1,5", "1.5m", "0x1", "+-1", "1e999", "--1"}) EXPECT_FALSE(parse_double(text)) << text;
}

}  // namespace numbers_test
}  // namespace fbvins
