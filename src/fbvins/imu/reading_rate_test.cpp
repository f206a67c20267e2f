// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/reading_rate.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace reading_rate_test {

std::vector<ImuSample> at(std::initializer_list<int> milliseconds) {
  std::vector<ImuSample> out;
  for (const int ms : milliseconds) out.push_back({Time{ms * 1'000'000LL}, {}, {}});
  return out;
}

TEST(ReadingRate, IsThatOfTheMedianIntervalWhateverIsMissing) {
  EXPECT_DOUBLE_EQ(rate_hz_of(at({0, 5, 10, 15, 400, 405})), 200);
  EXPECT_EQ(rate_hz_of(at({7})), 0);
  EXPECT_EQ(rate_hz_of(at({5, 5, 5})), 0);
}

}  // namespace reading_rate_test
}  // namespace fbvins
