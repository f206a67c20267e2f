// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_edit.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"
#include "fbvins/loop/map_file.hpp"

namespace fbvins {
namespace map_edit_test {

/// Keyframes a metre apart along x, with odometry between neighbours and a loop from the last to the first.
PlaceMap row_of(int keyframes) {
  Rng rng(1);
  PlaceMap map;
  for (int i = 0; i < keyframes; ++i) {
    MapKeyframe k;
    k.t = Time{1000 * (i + 1)};
    k.T_MB = {Quat::Identity(), Vec3(i, 0, 1)};
    k.T_GB = {Quat::Identity(), Vec3(i, 0, 1)};
    k.place.features.push_back({0.1f, 0.2f, 0.3f, 0.001f, 0.01f});
    k.place.descriptors.push_back({{rng.next_u32(), rng.next_u32(), rng.next_u32(), rng.next_u32()}});
    map.add(std::move(k));
    if (i > 0)
      map.edges.push_back(
          {KeyframeId{i - 1}, KeyframeId{i}, {Quat::Identity(), Vec3(1, 0, 0)}, Mat6::Identity(), MapEdge::Kind::odometry});
  }
  map.edges.push_back({KeyframeId{keyframes - 1},
                       KeyframeId{0},
                       {Quat::Identity(), Vec3(1 - keyframes, 0, 0)},
                       Mat6::Identity(),
                       MapEdge::Kind::loop});
  return map;
}

Result<PlaceMap> through_file(const PlaceMap& map) {
  const std::string bytes = serialise_map(map);
  return parse_map(std::as_bytes(std::span(bytes)), "a map");
}

TEST(CutMap, KeepsWhatIsInsideAndJoinsItsNeighbours) {
  const PlaceMap map = row_of(20);
  const PlaceMap inside = cut_map(map, {.low_M = {4.5, -1, 0}, .high_M = {9.5, 1, 2}});
  ASSERT_EQ(inside.size(), 5u);
  EXPECT_EQ(inside.keyframes().front().T_MB.p.x(), 5);
  EXPECT_TRUE(through_file(inside)) << "its edges have both ends";
  const PlaceMap outside = cut_map(map, {.low_M = {4.5, -1, 0}, .high_M = {9.5, 1, 2}}, true);
  ASSERT_EQ(outside.size(), 15u);
  EXPECT_TRUE(through_file(outside));
  const auto bridge = std::find_if(outside.edges.begin(), outside.edges.end(),
                                   [](const MapEdge& e) { return e.from == KeyframeId{4} && e.to == KeyframeId{10}; });
  ASSERT_NE(bridge, outside.edges.end()) << "the parts beside the cut are joined";
  EXPECT_NEAR(bridge->T_from_to.p.x(), 6, 1e-9);
  EXPECT_EQ(cut_map(map, {}).size(), 20u);
}

TEST(AlignMap, TurnsAboutTheVerticalAndMoves) {
  PlaceMap map = row_of(5);
  const Quat turn(Eigen::AngleAxisd(2.5, Vec3::UnitZ()));
  const Vec3 move(10, -20, 3);
  std::vector<SurveyedPoint> points;
  for (const Vec3& p : {Vec3(0, 0, 1), Vec3(4, 0, 1), Vec3(2, 3, 0)})
    points.push_back({p, turn * p + move + Vec3(0.01, -0.01, 0)});
  const auto done = align_map(map, points);
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_NEAR(done->heading_rad, 2.5, 1e-9);
  EXPECT_LT(done->rms_m, 1e-9);
  EXPECT_LT((map.keyframes()[4].T_MB.p - (turn * Vec3(4, 0, 1) + move + Vec3(0.01, -0.01, 0))).norm(), 1e-9);
  EXPECT_EQ(map.keyframes()[4].T_GB.p, Vec3(4, 0, 1)) << "the gauge of the flight stays";
}

TEST(AlignMap, PointsThatDoNotFitAreRefused) {
  PlaceMap map = row_of(5);
  const std::vector<Vec3> corners = {{0, 0, 0}, {4, 0, 0}, {4, 3, 0}};
  const auto with = [&](auto&& of) {
    std::vector<SurveyedPoint> points;
    for (const Vec3& p : corners) points.push_back({p, of(p)});
    return align_map(map, points);
  };
  EXPECT_TRUE(with([](const Vec3& p) { return p; }));
  EXPECT_EQ(align_map(map, {{{0, 0, 0}, {0, 0, 0}}, {{1, 0, 0}, {1, 0, 0}}}).error().message,
            "2 points are given where three are needed");
  EXPECT_NE(with([](const Vec3& p) { return Vec3(p.x(), -p.y(), p.z()); }).error().message.find("mirrored"), std::string::npos);
  EXPECT_FALSE(with([](const Vec3& p) { return Vec3(2 * p); })) << "another scale";
  map.anchored = true;
  EXPECT_NE(with([](const Vec3& p) { return p; }).error().message.find("anchored"), std::string::npos);
  map.anchored = false;
  EXPECT_FALSE(with([](const Vec3& p) { return Vec3(p.x(), p.z(), p.y()); })) << "other axes";
  EXPECT_NE(
      align_map(map, {{{1, 1, 0}, {0, 0, 0}}, {{1, 1, 5}, {0, 0, 5}}, {{1, 1, 9}, {0, 0, 9}}}).error().message.find("heading"),
      std::string::npos);
}

TEST(CompareMaps, CountsAndMeasuresWhatMoved) {
  const PlaceMap before = row_of(10);
  PlaceMap after = cut_map(before, {.high_M = {7.5, 1, 2}});
  EXPECT_EQ(compare_maps(before, before).largest_m, 0);
  after.keyframes()[3].T_MB.p.y() += 0.3;
  MapKeyframe extra = before.keyframes()[0];
  extra.id = {};
  extra.t = Time{99};
  after.add(extra);
  const MapDifference difference = compare_maps(before, after);
  EXPECT_EQ(difference.in_both, 8);
  EXPECT_EQ(difference.only_first, 2);
  EXPECT_EQ(difference.only_second, 1);
  EXPECT_NEAR(difference.largest_m, 0.3, 1e-12);
  EXPECT_NEAR(difference.rms_m, 0.3 / std::sqrt(8.0), 1e-12);
}

TEST(NamedMap, KeepsItsNameInTheFile) {
  PlaceMap map = row_of(3);
  const std::string without = serialise_map(map);
  map.name = "Hall 3, west";
  const auto named = through_file(map);
  ASSERT_TRUE(named) << named.error().message;
  EXPECT_EQ(named->name, "Hall 3, west");
  map.name.clear();
  EXPECT_EQ(serialise_map(map), without) << "maps without a name are as they were, for older programs, too";
}

}  // namespace map_edit_test
}  // namespace fbvins
