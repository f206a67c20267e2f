// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mavlink/clock_offset.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace clock_offset_test {

constexpr std::int64_t kMs = 1'000'000;

/// A cable with 1 ms each way, on which one of five requests or answers is delayed by up to 30 ms.
struct Cable {
  Rng rng{5};
  Time now{1'000'000 * kMs};

  std::int64_t way_ns() {
    return kMs + static_cast<std::int64_t>(rng.below(5) == 0 ? rng.below(30'000'000) : rng.below(100'000));
  }
  void ask(ClockOffset& offset, Duration ahead) {
    const Time asked = now, theirs = asked + Duration{way_ns()} + ahead, answered = theirs - ahead + Duration{way_ns()};
    offset.add(asked, theirs, answered);
    now = now + Duration{100 * kMs};
  }
};

TEST(ClockOffset, IsKnownToATenthOfAMillisecondInSpiteOfQueues) {
  Cable cable;
  ClockOffset offset;
  const Duration ahead{-123'456'789'012};
  int asked = 0;
  for (; !offset.known(); ++asked) cable.ask(offset, ahead);
  EXPECT_EQ(asked, 8);
  for (int i = 0; i < 200; ++i) {
    cable.ask(offset, ahead);
    if (i < 10) continue;
    EXPECT_LT(std::abs((offset.value() - ahead).ns), kMs / 10);
  }
  EXPECT_EQ(offset.jumps(), 0);
  EXPECT_GT(offset.round_trip().ns, 0);
  EXPECT_LT(offset.round_trip().ns, 30 * kMs);
}

TEST(ClockOffset, FollowsADrift) {
  Cable cable;
  ClockOffset offset;
  Duration ahead{5 * kMs};
  for (int i = 0; i < 600; ++i) cable.ask(offset, ahead = ahead + Duration{5'000});  // 50 ppm
  EXPECT_LT(std::abs((offset.value() - ahead).ns), kMs / 5);
}

TEST(ClockOffset, AJumpIsTakenAfterThreeAnswersAndIsNotKnownBeforeEnoughOfThem) {
  Cable cable;
  ClockOffset offset;
  for (int i = 0; i < 40; ++i) cable.ask(offset, Duration{5'000'000 * kMs});
  const Duration restarted{-7'000 * kMs};
  for (int i = 0; i < 2; ++i) cable.ask(offset, restarted);
  EXPECT_TRUE(offset.known());
  cable.ask(offset, restarted);
  EXPECT_FALSE(offset.known());
  EXPECT_EQ(offset.jumps(), 1);
  for (int i = 0; i < 10; ++i) cable.ask(offset, restarted);
  EXPECT_TRUE(offset.known());
  EXPECT_LT(std::abs((offset.value() - restarted).ns), kMs);
}

TEST(ClockOffset, ATimeThatNoClockHasIsIgnored) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max(), kLeast = std::numeric_limits<std::int64_t>::min();
  Cable cable;
  ClockOffset offset;
  const Duration ahead{5'000 * kMs};
  for (int i = 0; i < 40; ++i) {
    for (const std::int64_t theirs : {kMost, kLeast, kMost - 1, kLeast + 1, std::int64_t{-1}, std::int64_t{1} << 62})
      offset.add(cable.now, Time{theirs}, cable.now + Duration{kMs});
    cable.ask(offset, ahead);
  }
  EXPECT_TRUE(offset.known());
  EXPECT_FALSE(offset.in_doubt());
  EXPECT_EQ(offset.jumps(), 0);
  EXPECT_LT(std::abs((offset.value() - ahead).ns), kMs / 10);
}

TEST(ClockOffset, OneAnswerThatContradictsPutsItInDoubtAndOneThatDoesNotEndsThat) {
  Cable cable;
  ClockOffset offset;
  for (int i = 0; i < 20; ++i) cable.ask(offset, Duration{5'000 * kMs});
  EXPECT_FALSE(offset.in_doubt());
  cable.ask(offset, Duration{-7'000 * kMs});
  EXPECT_TRUE(offset.in_doubt());
  cable.ask(offset, Duration{5'000 * kMs});
  EXPECT_FALSE(offset.in_doubt());
}

TEST(ClockOffset, AnswersBeforeTheirRequestOrLongAfterAreIgnored) {
  ClockOffset offset;
  for (int i = 0; i < 20; ++i) {
    offset.add(Time{1000}, Time{5000}, Time{900});
    offset.add(Time{1000}, Time{5000}, Time{1'000'000'000});
  }
  EXPECT_FALSE(offset.known());
}

}  // namespace clock_offset_test
}  // namespace fbvins
