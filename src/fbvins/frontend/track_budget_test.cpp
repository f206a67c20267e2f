// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/track_budget.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace track_budget_test {

TEST(TrackBudget, SharesAlikeAtFirst) {
  const auto share = [](std::size_t groups) { return TrackBudget(150, groups).of(0); };
  EXPECT_EQ(share(1), 150);
  EXPECT_EQ(share(2), 100);
  EXPECT_EQ(share(3), 100);
  EXPECT_EQ(share(4), 75);
  EXPECT_EQ(share(6), 50);
}

TEST(TrackBudget, AnotherHasWhatADarkPairDoesNotUse) {
  TrackBudget budget(150, 2);
  for (int image = 0; image < 8; ++image) budget.note(0, budget.of(0)), budget.note(1, 20);
  EXPECT_GT(budget.of(0), 100);
  EXPECT_LT(budget.of(0), 150) << "not at once";
  for (int image = 0; image < 20; ++image) budget.note(0, budget.of(0)), budget.note(1, 20);
  EXPECT_EQ(budget.of(0), 150) << "no more than with nothing but this pair";
  EXPECT_EQ(budget.of(1), 100) << "the dark pair can take its share again at any time";
  budget.note(1, 100);
  EXPECT_EQ(budget.of(0), 100);
}

TEST(TrackBudget, WhatIsLeftIsNotGivenTwice) {
  TrackBudget budget(150, 4);
  for (int image = 0; image < 40; ++image)
    for (std::size_t k = 0; k < 4; ++k) budget.note(k, k == 0 ? 0 : budget.of(k));
  int all = 0;
  for (std::size_t k = 1; k < 4; ++k) all += budget.of(k);
  EXPECT_GE(all, 290);
  EXPECT_LE(all, 320);
}

}  // namespace track_budget_test
}  // namespace fbvins
