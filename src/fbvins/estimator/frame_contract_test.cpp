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
  for (const int camera : {0, 1}) f.see(camera, Observation{.pixel = Vec2(track, 1)});
  return f;
}

TEST(FrameContract, AFrameThatHoldsToItIsNotCopied) {
  TrackedFrame frame;
  frame.features = {seen(3), seen(1)};
  frame.stats.stereo = 2;
  FrameContract contract;
  EXPECT_EQ(&contract.enforced(frame, 2), &frame);
  EXPECT_EQ(contract.broken(), 0);
}

TEST(FrameContract, StereoMatchesThatWereNotCountedAreCounted) {
  TrackedFrame frame;
  frame.features = {seen(3), seen(1)};
  frame.features[0].forget(1);
  FrameContract contract;
  EXPECT_EQ(contract.enforced(frame, 2).stats.stereo, 1);
  EXPECT_EQ(contract.broken(), 0);
}

TEST(FrameContract, WhatCannotBeIsLeftOut) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::function<void(TrackedFeature&)> breaks[] = {
      [](TrackedFeature& f) { f.id = TrackId{1}; },
      [&](TrackedFeature& f) { f.by(0)->pixel.x() = nan; },
      [&](TrackedFeature& f) { f.by(1)->normalised.y() = nan; },
      [&](TrackedFeature& f) { f.by(0)->sqrt_information(0, 1) = 1 / 0.0; },
      [](TrackedFeature& f) { f.seen.clear(); },
      [](TrackedFeature& f) { f.see(2, Observation{}); },
      [](TrackedFeature& f) { f.by(1)->camera = 0; },
      [](TrackedFeature& f) { f.lead = -1; },
  };
  for (const auto& break_it : breaks) {
    TrackedFrame frame;
    frame.features = {seen(1), seen(2), seen(3)};
    break_it(frame.features[1]);
    FrameContract contract;
    const TrackedFrame& accepted = contract.enforced(frame, 2);
    ASSERT_EQ(accepted.features.size(), 2u);
    EXPECT_EQ(accepted.features[0].id, TrackId{1});
    EXPECT_EQ(accepted.features[1].id, TrackId{3});
    EXPECT_EQ(contract.broken(), 1);
    EXPECT_EQ(contract.enforced(TrackedFrame{}, 2).features.size(), 0u);
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
      frame.features[1].seen.front().normalised.x() = std::numeric_limits<double>::quiet_NaN();
    }
    last = estimator.process(frame).odometry;
    const Health expected{HealthState::degraded, HealthReason::frontend_fault};
    EXPECT_EQ(last.health == expected, k >= 60 && k < 80) << k;
  }
  EXPECT_EQ(last.health, (Health{HealthState::good, HealthReason::none}));
}

}  // namespace frame_contract_test
}  // namespace fbvins
