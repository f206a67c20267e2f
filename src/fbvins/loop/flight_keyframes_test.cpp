// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/flight_keyframes.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace flight_keyframes_test {

Pose<G, B> in_G(double x) { return {Quat::Identity(), Vec3(x, 0, 0)}; }

class KeyframesOfAFlight : public testing::Test {
 protected:
  /// Keyframes at 0, 1, 2, 3 s, a metre apart in W; the map has them 1.1 m apart.
  void SetUp() override {
    for (int i = 0; i < 4; ++i) {
      MapKeyframe k;
      k.t = Time{} + Duration::from_seconds(i);
      k.T_GB = in_G(i);
      k.T_MB.p.x() = 1.1 * i;
      flight_.add(k.t, map_.add(k));
    }
  }
  /// The flight in W, at keyframes, between them and after the last, as the map has it.
  auto corrected() const {
    const auto at = [](double t_s) { return Time{} + Duration::from_seconds(t_s); };
    return flight_.corrected(map_, {{at(0), in_G(0)},
                                    {at(0.5), in_G(0.5)},
                                    {at(1), in_G(1)},
                                    {at(1.5), in_G(1.5)},
                                    {at(2), in_G(2)},
                                    {at(3), in_G(3)},
                                    {at(4), in_G(4)}});
  }
  double x_at(std::size_t i) const {
    const auto in_M = corrected();
    const auto& [t, T_MB] = in_M.at(i);
    return T_MB.p.x();
  }

  PlaceMap map_;
  FlightKeyframes flight_;
};

TEST_F(KeyframesOfAFlight, IsExactAtKeyframesInterpolatedBetweenThemAndGoesOnAfterTheLast) {
  ASSERT_EQ(corrected().size(), 7u);
  EXPECT_NEAR(x_at(0), 0, 1e-12);
  EXPECT_NEAR(x_at(4), 2.2, 1e-12);
  EXPECT_NEAR(x_at(3), 0.5 * (1.1 + 0.5) + 0.5 * (2.2 - 0.5), 1e-12);
  EXPECT_NEAR(x_at(6), 3.3 + 1, 1e-12);
}

TEST_F(KeyframesOfAFlight, PosesOfARemovedKeyframeFollowItsHeir) {
  const Pose<B, B> T_successor_gone(Quat::Identity(), Vec3(1.1, 0, 0));
  flight_.hand_over(KeyframeId{2}, KeyframeId{1}, T_successor_gone);
  map_.remove(KeyframeId{2});
  EXPECT_NEAR(x_at(4), 2.2, 1e-12);
  map_.find(KeyframeId{1})->T_MB.p.x() += 0.5;
  EXPECT_NEAR(x_at(4), 2.7, 1e-12);
}

TEST_F(KeyframesOfAFlight, WhatIsLostOrHasNoPlaceIsBridged) {
  flight_.drop(KeyframeId{1});
  map_.find(KeyframeId{2})->placed = false;
  EXPECT_NEAR(x_at(2), 2.0 / 3 * 1 + 1.0 / 3 * (3.3 - 2), 1e-12);  // between the keyframes at 0 and 3 s
}

TEST_F(KeyframesOfAFlight, AFlightWithoutAPlaceInMIsEmpty) {
  for (MapKeyframe& k : map_.keyframes()) k.placed = false;
  EXPECT_TRUE(corrected().empty());
  flight_ = {};
  EXPECT_TRUE(corrected().empty());
}

TEST(FlightKeyframes, OfADayOlderKeyframesAreLeftOutAndTheFlightIsStillWhole) {
  constexpr int kKeyframes = 200'000;
  PlaceMap map;
  MapKeyframe only;
  only.t = Time{};
  const KeyframeId id = map.add(only);
  FlightKeyframes flight;
  Trajectory<G> in_G;
  for (int i = 0; i < kKeyframes; ++i) {
    const Time t = Time{} + Duration::from_seconds(0.5 * i);
    flight.add(t, id);
    if (i % 1000 == 0) in_G.push_back({t, {}});
  }
  EXPECT_LE(flight.size(), 40'000u);
  EXPECT_GE(flight.size(), 10'000u);
  EXPECT_EQ(flight.corrected(map, in_G).size(), in_G.size());
}

}  // namespace flight_keyframes_test
}  // namespace fbvins
