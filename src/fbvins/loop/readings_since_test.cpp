// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/readings_since.hpp"

#include <gtest/gtest.h>

#include "tests/support/test_room.hpp"

namespace fbvins {
namespace readings_since_test {

using namespace test_room;

Time at_s(double s) { return Time{} + Duration::from_seconds(s); }

std::vector<ImuSegment> read(double from_s, double to_s) { return {readings(at_s(from_s), at_s(to_s), {})}; }

TEST(ReadingsSince, AreThoseFromTheNewestKeyframeOn) {
  ReadingsSince since;
  since.add(read(2, 2.5), at_s(2.5), at_s(2));
  since.add(read(2.5, 3), at_s(3), at_s(2));
  const auto all = since.until(at_s(3), at_s(2), {});
  ASSERT_TRUE(all);
  EXPECT_NEAR(all->dt_s(), 1, 1e-9);
  EXPECT_FALSE(since.until(at_s(3), at_s(1.5), {})) << "they begin later";
  EXPECT_FALSE(since.until(at_s(3.5), at_s(2), {})) << "they end earlier";
  since.restart();
  since.add(read(3, 3.5), at_s(3.5), at_s(3));
  ASSERT_TRUE(since.until(at_s(3.5), at_s(3), {}));
}

TEST(ReadingsSince, AreNoneWhereSomeAreMissingOrTheyLastTooLong) {
  ReadingsSince first, gap, longer;
  first.add(read(2, 2.5), at_s(2.5), std::nullopt);
  EXPECT_FALSE(first.until(at_s(2.5), at_s(2), {})) << "there is no keyframe that they begin at";
  gap.add({}, at_s(2.5), at_s(2));
  gap.add(read(2.5, 3), at_s(3), at_s(2));
  EXPECT_FALSE(gap.until(at_s(3), at_s(2.5), {}));
  gap.restart();
  gap.add(read(3, 3.5), at_s(3.5), at_s(3));
  EXPECT_TRUE(gap.until(at_s(3.5), at_s(3), {}));
  longer.add(read(2, 7.5), at_s(7.5), at_s(2));
  EXPECT_FALSE(longer.until(at_s(7.5), at_s(2), {}));
}

}  // namespace readings_since_test
}  // namespace fbvins
