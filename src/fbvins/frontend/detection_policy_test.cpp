// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_examination.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace orb_examination_test {

/// How many of `images` consecutive images are examined, with `observed` tracks in each.
int examined_of(ExaminationPolicy& policy, int images, int observed) {
  int examined = 0;
  for (int i = 0; i < images; ++i) {
    const bool due = policy.due(observed);
    policy.pass(due, observed);
    examined += due;
  }
  return examined;
}

TEST(ExaminationPolicy, OneImageInFourWhileNothingIsLost) {
  ExaminationPolicy policy(false);
  policy.pass(true, 100);
  EXPECT_EQ(examined_of(policy, 40, 100), 10);
}

TEST(ExaminationPolicy, AtOnceWhenTracksAreLost) {
  ExaminationPolicy policy(false);
  policy.pass(true, 100);
  EXPECT_FALSE(policy.due(81));
  EXPECT_TRUE(policy.due(79));
}

TEST(ExaminationPolicy, EveryImageWhileAllIsDarkAndTheFirstAfterIt) {
  ExaminationPolicy policy(false);
  policy.pass(true, 100);
  EXPECT_EQ(examined_of(policy, 20, 0), 20);
}

TEST(ExaminationPolicy, AdaptsToALastingDropInTracks) {
  ExaminationPolicy policy(false);
  policy.pass(true, 100);
  EXPECT_LT(examined_of(policy, 40, 30), 15);
}

TEST(ExaminationPolicy, AllWhereTracksCannotBeFollowed) {
  ExaminationPolicy policy(true);
  EXPECT_EQ(examined_of(policy, 10, 100), 10);
}

}  // namespace orb_examination_test
}  // namespace fbvins
