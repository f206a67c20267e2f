// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/detection_policy.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace detection_policy_test {

/// How many of `images` consecutive images have keypoints detected, with `observed` tracks in each.
int detecting_of(DetectionPolicy& policy, int images, int observed) {
  int detecting = 0;
  for (int i = 0; i < images; ++i) {
    const bool due = policy.due(observed);
    policy.pass(due, observed);
    detecting += due;
  }
  return detecting;
}

TEST(DetectionPolicy, OneImageInFourWhileNothingIsLost) {
  DetectionPolicy policy;
  policy.pass(true, 100);
  EXPECT_EQ(detecting_of(policy, 40, 100), 10);
}

TEST(DetectionPolicy, AtOnceWhenTracksAreLost) {
  DetectionPolicy policy;
  policy.pass(true, 100);
  EXPECT_FALSE(policy.due(81));
  EXPECT_TRUE(policy.due(79));
}

TEST(DetectionPolicy, TracksThatWereAddedCount) {
  DetectionPolicy policy;
  policy.pass(true, 80);
  policy.add(20);
  EXPECT_FALSE(policy.due(81));
  EXPECT_TRUE(policy.due(79));
}

TEST(DetectionPolicy, EveryImageWhileAllIsDarkAndTheFirstAfterIt) {
  DetectionPolicy policy;
  policy.pass(true, 100);
  EXPECT_EQ(detecting_of(policy, 20, 0), 20);
}

TEST(DetectionPolicy, AdaptsToALastingDropInTracks) {
  DetectionPolicy policy;
  policy.pass(true, 100);
  EXPECT_LT(detecting_of(policy, 40, 30), 15);
}

}  // namespace detection_policy_test
}  // namespace fbvins
