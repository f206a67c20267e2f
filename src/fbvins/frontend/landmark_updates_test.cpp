// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/landmark_updates.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace landmark_updates_test {

using Kind = LandmarkUpdates::Kind;

LandmarkUpdate update(std::int64_t sequence, std::uint32_t reset_counter = 0) { return {sequence, reset_counter, {}}; }

TEST(LandmarkUpdates, EveryUpdateCountsOnce) {
  LandmarkUpdates updates;
  EXPECT_EQ(updates.take(update(0)), Kind::next);
  EXPECT_EQ(updates.take(update(0)), Kind::repeated);
  EXPECT_EQ(updates.take(update(1)), Kind::next);
  EXPECT_EQ(updates.take(update(0)), Kind::repeated);
}

TEST(LandmarkUpdates, ANewWIsReportedOnce) {
  LandmarkUpdates updates;
  EXPECT_EQ(updates.take(update(0)), Kind::next);
  EXPECT_EQ(updates.take(update(1, 1)), Kind::earlier_void);
  EXPECT_EQ(updates.take(update(2, 1)), Kind::next);
}

TEST(LandmarkUpdatesDeathTest, AGapIsABug) {
  LandmarkUpdates updates;
  updates.take(update(0));
  EXPECT_DEBUG_DEATH(updates.take(update(2)), "without gaps");
}

}  // namespace landmark_updates_test
}  // namespace fbvins
