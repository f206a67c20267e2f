// SPDX-License-Identifier: Apache-2.0
// Flights of one camera in a map, each of its own scale (docs/derivations/loop.md, L33).
#include "fbvins/loop/flight_scale.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/map_front.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins {
namespace flight_scale_test {

using namespace test_room;

/// Lengths are `longer` times the true ones, in what the odometry says and in the depths of places. Returns the odometry.
Trajectory<G> fly(LoopCloser& closer, const std::vector<Frame>& frames, double longer, double scale_sigma) {
  Trajectory<G> flown;
  for (const Frame& f : frames) {
    Keyframe k = keyframe(FrameId{f.t.ns}, f.t, {f.odometry.q, longer * f.odometry.p});
    flown.push_back({f.t, k.gauge.T_GB});
    k.scale_sigma = scale_sigma;
    Place place = f.place;
    for (PlaceFeature& feature : place.features) {
      feature.inverse_depth /= static_cast<float>(longer);
      feature.sigma_inverse_depth /= static_cast<float>(longer);
    }
    closer.process(std::move(place), k);
  }
  return flown;
}

PlaceMap filed(const PlaceMap& map) {
  const std::string bytes = serialise_map(map);
  return *parse_map(std::as_bytes(std::span(bytes)), "a map");
}

PlaceMap map_of(double longer, double scale_sigma) {
  LoopCloser closer(rig(), {}, vocabulary());
  fly(closer, flight(room(1), 100, 0.001, 0.01, 2), longer, scale_sigma);
  closer.finish();
  return filed(closer.map());
}

/// Length over the true one, of poses about their middle.
double length_of(const Trajectory<M>& poses) {
  Vec3 seen = Vec3::Zero(), truth = Vec3::Zero();
  for (const auto& [t, T] : poses) seen += T.p, truth += true_pose(t.seconds()).p;
  double seen2 = 0, truth2 = 0;
  const auto n = static_cast<double>(poses.size());
  for (const auto& [t, T] : poses)
    seen2 += (T.p - seen / n).squaredNorm(), truth2 += (true_pose(t.seconds()).p - truth / n).squaredNorm();
  return std::sqrt(seen2 / truth2);
}

double length_in(const PlaceMap& map, std::uint32_t session) {
  Trajectory<M> poses;
  for (const MapKeyframe& k : map.keyframes())
    if (k.session == session) poses.push_back({k.t, k.T_MB});
  return length_of(poses);
}

TEST(FlightScale, TheNumberOfKeyframesDoesNotCount) {
  FlightScale scale;
  EXPECT_EQ(scale.sigma(), 0);
  scale.add(0);
  EXPECT_EQ(scale.sigma(), 0);
  for (int i = 0; i < 10; ++i) scale.add(0.02);
  EXPECT_NEAR(scale.sigma(), 0.02, 1e-12);
  for (int i = 0; i < 10; ++i) scale.add(0.04);
  EXPECT_NEAR(scale.sigma(), 0.0253, 1e-4) << "the better known part counts more";
}

TEST(FlightScale, OneFlightKeepsItsOwn) {
  const PlaceMap map = map_of(1.03, 0.02);
  ASSERT_EQ(map.sessions.size(), 1u);
  EXPECT_NEAR(map.sessions[0].scale_sigma, 0.02, 1e-12);
  EXPECT_EQ(map.sessions[0].log_scale, 0);
  EXPECT_NEAR(length_in(map, 0), 1.03, 0.003);
  EXPECT_EQ(serialise_map(filed(map)), serialise_map(map));
}

TEST(FlightScale, AFlightTakesThatOfAMapThatMeasuredLengths) {
  LoopCloser closer(rig(), {}, vocabulary(), map_of(1, 0));
  const Trajectory<G> flown = fly(closer, flight(room(1), 60, 0.001, 0.01, 9, 7.3), 1.03, 0.02);
  closer.finish();
  EXPECT_TRUE(closer.objections().empty());
  EXPECT_NEAR(closer.map().sessions.at(1).log_scale, -std::log(1.03), 0.004);
  EXPECT_NEAR(length_of(closer.corrected(flown)), 1, 0.003);
  EXPECT_NEAR(length_in(closer.map(), 0), 1, 0.003);
}

TEST(FlightScale, AMapOfOneCameraTakesThatOfAFlightThatMeasuresLengths) {
  LoopCloser closer(rig(), {}, vocabulary(), map_of(1.03, 0.02));
  fly(closer, flight(room(1), 60, 0.001, 0.01, 9, 7.3), 1, 0);
  closer.finish();
  EXPECT_TRUE(closer.objections().empty());
  EXPECT_NEAR(closer.map().sessions.at(0).log_scale, -std::log(1.03), 0.004);
  EXPECT_NEAR(length_in(closer.map(), 0), 1, 0.004);
}

TEST(FlightScale, TwoFlightsMeetByWhatEachKnows) {
  LoopCloser closer(rig(), {}, vocabulary(), map_of(1.03, 0.02));
  const Trajectory<G> flown = fly(closer, flight(room(1), 60, 0.001, 0.01, 9, 7.3), 0.98, 0.01);
  closer.finish();
  EXPECT_TRUE(closer.objections().empty());
  const double wanted = std::exp((std::log(1.03) / 4 + std::log(0.98)) / (1 + 0.25));
  EXPECT_NEAR(length_in(closer.map(), 0), wanted, 0.005);
  EXPECT_NEAR(length_of(closer.corrected(flown)), wanted, 0.005);
}

TEST(FlightScale, MeasurementsInMetresFitAsBefore) {
  LoopCloser closer(rig(), {}, vocabulary(), map_of(1.03, 0.02));
  fly(closer, flight(room(1), 60, 0.001, 0.01, 9, 7.3), 0.98, 0.01);
  closer.finish();
  const PlaceMap& map = closer.map();
  PlaceMap copy = map;
  ASSERT_TRUE(read_places(copy).ok());
  const PlaceMap metric = in_metres(copy);
  for (const MapSession& s : metric.sessions) EXPECT_EQ(s.log_scale, 0);
  const std::vector<double> before = map.chi2_of_edges({.degrees_of_freedom = 6}),
                            after = metric.chi2_of_edges({.degrees_of_freedom = 6});
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_NEAR(after[i], before[i], 1e-6 * before[i]);
  const double metre = std::exp(map.sessions[0].log_scale);
  EXPECT_NEAR(copy.keyframes()[0].place.features[0].inverse_depth / metric.keyframes()[0].place.features[0].inverse_depth, metre,
              1e-6);
}

TEST(FlightScale, OneThatIsOffByTooMuchLeavesTheMapAsItWasToTheByte) {
  const PlaceMap before = map_of(1.01, 0.02);
  LoopCloser closer(rig(), {}, vocabulary(), before);
  fly(closer, flight(room(1), 60, 0.001, 0.01, 9, 7.3), 0.9, 0.005);
  closer.finish();
  ASSERT_TRUE(closer.reduced());
  EXPECT_EQ(serialise_map(*closer.reduced()), serialise_map(before));
}

}  // namespace flight_scale_test
}  // namespace fbvins
