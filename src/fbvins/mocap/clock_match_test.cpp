// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/clock_match.hpp"

#include <gtest/gtest.h>

#include "tests/support/hand_eye_scene.hpp"

namespace fbvins {
namespace clock_match_test {

constexpr Time kStart{1'700'000'000'000'000'000};

TEST(ClockMatch, FindsAnyOffsetToAFewMilliseconds) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const test::ExactFlight flight(seed, 30, false);
    const test::MarkerRecording recording =
        test::record(flight, kStart, {.gaps = 1, .jump = false, .flip_behind_gap = false}, seed);
    const auto match = match_clocks(recording.track, test::estimate_of(flight, kStart, {}, seed));
    ASSERT_TRUE(match.ok()) << match.error().message;
    EXPECT_NEAR((match->offset - recording.truth.offset).seconds(), 0, 0.015);
    EXPECT_GT(match->correlation, 0.7);
  }
}

TEST(ClockMatch, RefusesAnotherFlightAndShortOnes) {
  const test::ExactFlight flight(1, 60), other(21, 60);
  const MarkerTrack track = test::record(flight, kStart, {}, 1).track;
  const auto match = match_clocks(track, test::estimate_of(other, kStart, {}, 1));
  ASSERT_FALSE(match.ok());
  EXPECT_NE(match.error().message.find("at no offset of the clocks do markers and estimate turn alike"), std::string::npos);
  const auto too_short = match_clocks(MarkerTrack(track.begin(), track.begin() + 100), test::estimate_of(flight, kStart, {}, 1));
  ASSERT_FALSE(too_short.ok());
  EXPECT_NE(too_short.error().message.find("both need 8 s"), std::string::npos);
}

}  // namespace clock_match_test
}  // namespace fbvins
