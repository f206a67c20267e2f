// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/frame_contract.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "fbvins/estimator/estimator.hpp"
#include "tests/support/simulated_flight.hpp"

namespace fbvins {
namespace frame_contract_test {

using test::Motion;
using test::SimulatedFlight;

TrackedFeature seen(int track) {
  TrackedFeature f;
  f.id = TrackId{track};
  f.left.emplace().pixel = Vec2(track, 1);
  f.right = f.left;
  return f;
}

TEST(FrameContract, AFrameThatHoldsToItIsNotCopied) {
  TrackedFrame frame;
  frame.features = {seen(3), seen(1)};
  frame.stats.stereo = 2;
  FrameContract contract;
  EXPECT_EQ(&contract.enforced(frame), &frame);
  EXPECT_EQ(contract.broken(), 0);
}

TEST(FrameContract, StereoMatchesThatWereNotCountedAreCounted) {
  TrackedFrame frame;
  frame.features = {seen(3), seen(1)};
  frame.features[0].right.reset();
  FrameContract contract;
  EXPECT_EQ(contract.enforced(frame).stats.stereo, 1);
  EXPECT_EQ(contract.broken(), 0);
}

TEST(FrameContract, WhatCannotBeIsLeftOut) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::function<void(TrackedFeature&)> breaks[] = {
      [](TrackedFeature& f) { f.id = TrackId{1}; },
      [&](TrackedFeature& f) { f.left->pixel.x() = nan; },
      [&](TrackedFeature& f) { f.right->normalised.y() = nan; },
      [&](TrackedFeature& f) { f.left->sqrt_information(0, 1) = 1 / 0.0; },
      [](TrackedFeature& f) { f.left.reset(), f.right.reset(); },
  };
  for (const auto& break_it : breaks) {
    TrackedFrame frame;
    frame.features = {seen(1), seen(2), seen(3)};
    break_it(frame.features[1]);
    FrameContract contract;
    const TrackedFrame& accepted = contract.enforced(frame);
    ASSERT_EQ(accepted.features.size(), 2u);
    EXPECT_EQ(accepted.features[0].id, TrackId{1});
    EXPECT_EQ(accepted.features[1].id, TrackId{3});
    EXPECT_EQ(contract.broken(), 1);
    EXPECT_EQ(contract.enforced(TrackedFrame{}).features.size(), 0u);
    EXPECT_EQ(contract.broken(), 0);
  }
}

TEST(FrameContract, AFlightGoesOnAndSaysSo) {
  SimulatedFlight flight(Motion(0.6, 0.3), 7);
  Estimator estimator(flight.rig, {});
  Odometry last;
  for (int k = 0; k <= 80; ++k) {
    TrackedFrame frame = flight.frame(k);
    if (k >= 60 && k < 80) {
      const std::vector<TrackedFeature> again = frame.features;
      frame.features.insert(frame.features.end(), again.begin(), again.end());
      frame.features[1].left->normalised.x() = std::numeric_limits<double>::quiet_NaN();
    }
    last = estimator.process(frame).odometry;
    const Health expected{HealthState::degraded, HealthReason::frontend_fault};
    EXPECT_EQ(last.health == expected, k >= 60 && k < 80) << k;
  }
  EXPECT_EQ(last.health, (Health{HealthState::good, HealthReason::none}));
}

}  // namespace frame_contract_test
}  // namespace fbvins
