// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/candidate_search.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace candidate_search_test {

constexpr int kWords = 10;
constexpr double kFlown_m = 100;                                                    // until the query, far from all others
const Pose<B, C0> kForward(so3_exp(Vec3(0, 1.5707963267948966, 0)), Vec3::Zero());  // the camera looks along the body's x

PlaceMap forward() {
  PlaceMap map;
  map.cameras[0] = kForward;
  return map;
}

class Search : public testing::Test {
 protected:
  KeyframeId add(double t_s, const Vec3& p, double yaw_rad, float similarity, std::uint32_t session = 0) {
    MapKeyframe k;
    k.t = Time{} + Duration::from_seconds(t_s);
    k.session = session;
    k.T_MB = {so3_exp(Vec3(0, 0, yaw_rad)), p};
    const BowVector words{{0, similarity}, {1, 1 - similarity}};
    k.place.words = words;
    const KeyframeId id = map_.add(std::move(k));
    search_.add(id, words);
    return id;
  }
  static MapKeyframe query(double t_s) {
    MapKeyframe q;
    q.t = Time{} + Duration::from_seconds(t_s);
    q.path_m = kFlown_m;
    q.place.words = {{0, 1.0f}};
    return q;
  }

  PlaceMap map_ = forward();
  CandidateSearch search_{kWords, 4.0};
};

TEST_F(Search, FindsTheMostSimilarOnesAroundHereThatLookTheSameWay) {
  const KeyframeId good = add(0, Vec3(1, 0, 0), 0.3, 0.5f), better = add(10, Vec3(0, 2, 0), -0.5, 0.9f);
  add(20, Vec3(4.5, 0, 0), 0, 0.9f);                      // too far
  add(30, Vec3(0, 0, 0), 1.3, 0.9f);                      // looks elsewhere
  const KeyframeId young = add(99, Vec3(0, 0, 0), 0, 1);  // too recent: the odometry connects it
  EXPECT_EQ(search_.around(map_, query(100), 0), (std::vector{better, good}));
  EXPECT_EQ(search_.around(map_, query(200), 0), (std::vector{young, better, good}));
}

TEST_F(Search, ReachesFartherWhereThePositionIsUncertain) {
  const KeyframeId far = add(0, Vec3(6, 0, 0), 0, 0.5f);
  EXPECT_TRUE(search_.around(map_, query(100), 0.5).empty());
  EXPECT_EQ(search_.around(map_, query(100), 1.0), std::vector{far});
}

TEST_F(Search, AFlightThatOnlyLeftAPlaceHasNotComeBackToIt) {
  const KeyframeId left = add(0, Vec3(2, 0, 0), 0, 0.5f);
  const KeyframeId of_another = add(10, Vec3(2, 0, 0), 0, 0.4f, 1);
  map_.find(left)->path_m = map_.find(of_another)->path_m = kFlown_m - 3.9;
  EXPECT_EQ(search_.around(map_, query(100), 0), std::vector{of_another});
  map_.find(left)->path_m = kFlown_m - 4.1;
  EXPECT_EQ(search_.around(map_, query(100), 0), (std::vector{left, of_another}));
}

TEST_F(Search, NeighboursInTimeAreOnePlaceOfThreeAtMost) {
  for (int place = 0; place < 5; ++place)
    for (int i = 0; i < 3; ++i) add(10 * place + 0.5 * i, Vec3(0, 0, 0), 0, 0.9f - 0.1f * static_cast<float>(place));
  const auto found = search_.around(map_, query(100), 0);
  ASSERT_EQ(found.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(found[i].value / 3, static_cast<std::int64_t>(i));
}

TEST_F(Search, AnywhereNeighboursSupportAPlace) {
  const KeyframeId alone = add(0, Vec3(50, 0, 0), 2, 0.6f);
  const KeyframeId first = add(10, Vec3(90, 0, 0), 2, 0.5f);
  add(10.5, Vec3(90, 0, 0), 2, 0.5f);
  add(11, Vec3(90, 0, 0), 2, 0.5f);
  EXPECT_EQ(search_.anywhere(map_, query(100)), (std::vector{first, alone}));
  map_.find(alone)->placed = false;
  EXPECT_EQ(search_.anywhere(map_, query(100)), std::vector{first});
}

TEST_F(Search, AnotherFlightsKeyframesOfTheSameTimeAreNoNeighbours) {
  const KeyframeId alone = add(0, Vec3(50, 0, 0), 2, 0.6f);
  const KeyframeId first = add(10, Vec3(90, 0, 0), 2, 0.5f, 1);
  const KeyframeId second = add(10.5, Vec3(10, 0, 0), 2, 0.49f, 2);
  EXPECT_EQ(search_.anywhere(map_, query(100)), (std::vector{alone, first, second}));
}

TEST_F(Search, WhatIsRemovedIsNotFound) {
  const KeyframeId id = add(0, Vec3(0, 0, 0), 0, 0.5f);
  search_.remove(id, {{0, 0.5f}, {1, 0.5f}});
  EXPECT_TRUE(search_.around(map_, query(100), 0).empty());
  EXPECT_TRUE(search_.anywhere(map_, query(100)).empty());
}

BowVector some_words(Rng& rng, int words) {
  BowVector bow;
  for (std::int32_t w = 0; w < words; ++w)
    if (rng.below(3) == 0) bow.push_back({w, static_cast<float>(rng.uniform(0.01, 0.02))});
  return bow;
}

/// So many keyframes that a query would look at more than a hundred thousand entries.
TEST(LargeMap, GivesTheMostSimilarOnesAsASmallOneDoes) {
  constexpr int kManyWords = 200, kKeyframes = 6000;
  Rng rng(1);
  PlaceMap map = forward();
  CandidateSearch search(kManyWords, 4.0);
  for (int i = 0; i < kKeyframes; ++i) {
    MapKeyframe k;
    k.t = Time{} + Duration::from_seconds(10.0 * i);
    k.T_MB.p = Vec3(i, 0, 0);
    k.place.words = some_words(rng, kManyWords);
    const BowVector words = k.place.words;
    search.add(map.add(std::move(k)), words);
  }
  for (const int i : {7, 777, 5990}) {
    MapKeyframe query = map.keyframes()[static_cast<std::size_t>(i)];
    query.session = 1;
    for (std::size_t w = 0; w < query.place.words.size(); w += 4) query.place.words[w].weight = 0.001f;
    EXPECT_EQ(search.anywhere(map, query)[0], KeyframeId{i});
    const std::vector<KeyframeId> near = search.around(map, query, 0);
    ASSERT_EQ(near.size(), 3u);
    EXPECT_EQ(near[0], KeyframeId{i});
    for (const KeyframeId id : near) EXPECT_LE(std::abs(id.value - i), 4);
  }
}

}  // namespace candidate_search_test
}  // namespace fbvins
