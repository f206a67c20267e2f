// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/coverage.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace coverage_test {

std::vector<Time> every_50ms(int from, int to) {
  std::vector<Time> stamps;
  for (int i = from; i < to; ++i) stamps.push_back(Time{50'000'000LL * i});
  return stamps;
}

TEST(Coverage, CountsImagesWithAPoseAndTheStart) {
  const Coverage c = coverage_of(every_50ms(0, 100), every_50ms(20, 100));
  EXPECT_EQ(c.images, 100);
  EXPECT_EQ(c.with_pose, 80);
  EXPECT_DOUBLE_EQ(c.share, 0.8);
  EXPECT_DOUBLE_EQ(c.first_pose_after_s, 1.0);
  EXPECT_DOUBLE_EQ(c.longest_hole_s, 0.05);
}

TEST(Coverage, StampsRoundedToMicrosecondsStillCount) {
  std::vector<Time> poses = every_50ms(0, 10);
  for (Time& t : poses) t = t + Duration{300};
  EXPECT_EQ(coverage_of(every_50ms(0, 10), poses).with_pose, 10);
}

TEST(Coverage, ExtraPosesDoNotRaiseIt) {
  std::vector<Time> poses = every_50ms(0, 5);
  for (int i = 0; i < 5; ++i) poses.push_back(Time{50'000'000LL * i + 25'000'000});
  EXPECT_EQ(coverage_of(every_50ms(0, 10), poses).with_pose, 5);
}

TEST(Coverage, HoleAndNothing) {
  std::vector<Time> poses = every_50ms(0, 10);
  poses.push_back(Time{2'450'000'000});
  EXPECT_DOUBLE_EQ(coverage_of(every_50ms(0, 60), poses).longest_hole_s, 2.0);
  const Coverage none = coverage_of(every_50ms(0, 60), {});
  EXPECT_EQ(none.with_pose, 0);
  EXPECT_EQ(none.share, 0);
  EXPECT_EQ(coverage_of({}, {}).share, 0);
}

}  // namespace coverage_test
}  // namespace fbvins
