// SPDX-License-Identifier: Apache-2.0
// Tags whose place nobody has measured: landmarks that tie a flight to itself and to the flights before.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/map_merge.hpp"
#include "fbvins/loop/map_sessions.hpp"
#include "fbvins/loop/map_tags.hpp"
#include "tests/support/anchored_flight.hpp"

namespace fbvins {
namespace loop_closer_tags_test {

using namespace test_room;

/// A flight of which the map sees tags and nothing else.
std::vector<Frame> blind(std::vector<Frame> frames) {
  for (Frame& f : frames) f.place.features.clear(), f.place.descriptors.clear(), f.place.words.clear();
  return frames;
}

std::vector<Anchor> landmarks(const Frame& f, Rng& rng, double wrong_share = 0) {
  std::vector<Anchor> out = seen_tags(f, rng, wrong_share);
  for (Anchor& a : out) std::get<TagAnchor>(a).T_AT = unknown_place();
  return out;
}

struct Errors {
  double m = 0, aligned_m = 0;  ///< as they are, and after the best turn about z and shift
  int known = 0;
};

/// Of the poses in M as known in flight, against the truth in the frame of the first flight.
Errors fly(LoopCloser& closer, const std::vector<Frame>& frames, Rng& rng, const Pose<G, G>& gauge, double wrong_share = 0,
           bool with_tags = true, const Vec3& moved = Vec3::Zero()) {
  Errors e;
  std::vector<Pose<M, B>> estimated, truth;
  for (const Frame& f : frames) {
    Keyframe k = keyframe(FrameId{f.t.ns / 1000}, f.t, gauge * f.odometry);
    if (with_tags) k.anchors = landmarks(f, rng, wrong_share);
    for (Anchor& a : k.anchors) std::get<TagAnchor>(a).T_BT.p += truth_of(f).q.conjugate() * moved;
    const MapUpdate u = closer.process(f.place, k);
    if (!u.localised) continue;
    estimated.push_back(u.T_MG * k.gauge.T_GB), truth.push_back({f.truth.q, f.truth.p});
  }
  closer.finish();
  const Pose<M, M> T = nearest_to(truth, estimated, 0);
  e.known = static_cast<int>(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    e.m += (estimated[i].p - truth[i].p).squaredNorm() / e.known;
    e.aligned_m += (T * estimated[i].p - truth[i].p).squaredNorm() / e.known;
  }
  e.m = std::sqrt(e.m), e.aligned_m = std::sqrt(e.aligned_m);
  return e;
}

const Pose<G, G> kSame;
const Pose<G, G> kElsewhere(about_z(2.0), Vec3(5, -3, 1));

TEST(TagLandmarks, HoldAFlightThatRecognisesNothingElse) {
  const auto frames = blind(flight(room(1), 200, 0.01, 0.15, 2));
  Errors with, without;
  for (const bool tags : {false, true}) {
    Rng rng(7);
    LoopCloser closer(rig(), {}, vocabulary());
    (tags ? with : without) = fly(closer, frames, rng, kSame, 0, tags);
    EXPECT_EQ(closer.map().tags.empty(), !tags);
  }
  EXPECT_EQ(with.known, 200);
  EXPECT_LT(with.aligned_m, 0.75 * without.aligned_m);
}

TEST(TagLandmarks, JoinFlightsAlsoFromTheFile) {
  Rng rng(7);
  LoopCloser first(rig(), {}, vocabulary());
  fly(first, blind(flight(room(1), 120, 0.001, 0.01, 2)), rng, kSame);
  const std::string bytes = serialise_map(first.map());
  const auto loaded = parse_map(std::as_bytes(std::span(bytes)), "map");
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  ASSERT_EQ(loaded->tags.size(), first.map().tags.size());
  EXPECT_EQ(serialise_map(*loaded), bytes);
  LoopCloser second(rig(), {}, vocabulary(), *loaded);
  const Errors found = fly(second, blind(flight(room(1), 120, 0.001, 0.01, 9, 7.3)), rng, kElsewhere);
  EXPECT_GT(found.known, 60) << "from the second tag on";
  EXPECT_LT(found.m, 0.08) << "a tag 4 m away tells the position to 8 cm here";
  EXPECT_TRUE(second.objections().empty());
  std::set<std::uint32_t> sessions;
  for (const MapTag& t : second.map().tags) sessions.insert(second.map().find(t.keyframe)->session);
  EXPECT_EQ(sessions.size(), 2u) << "the map has views of both flights";
}

TEST(TagLandmarks, OneTagAloneSaysNothingOfWhereAFlightIs) {
  Rng rng(7);
  LoopCloser first(rig(), {}, vocabulary());
  fly(first, blind(flight(room(1), 120, 0.001, 0.01, 2)), rng, kSame);
  LoopCloser second(rig(), {}, vocabulary(), first.map());
  for (const Frame& f : blind(flight(room(1), 120, 0.001, 0.01, 9, 7.3))) {
    Keyframe k = keyframe(FrameId{f.t.ns / 1000}, f.t, kElsewhere * f.odometry);
    for (const Anchor& a : landmarks(f, rng))
      if (std::get<TagAnchor>(a).id == 0) k.anchors.push_back(a);
    EXPECT_FALSE(second.process(f.place, k).localised);
  }
}

TEST(TagLandmarks, WrongNumbersChangeLittle) {
  const auto frames = blind(flight(room(1), 160, 0.003, 0.04, 2));
  Errors right, wrong;
  for (const bool some_wrong : {false, true}) {
    Rng rng(7);
    LoopCloser closer(rig(), {}, vocabulary());
    (some_wrong ? wrong : right) = fly(closer, frames, rng, kSame, some_wrong ? 0.2 : 0);
  }
  EXPECT_LT(wrong.m, 2 * right.m + 0.02);
  EXPECT_LT(wrong.m, 0.15);
}

TEST(TagLandmarks, OnesThatWereHungElsewhereAreRefused) {
  Rng rng(7);
  LoopCloser first(rig(), {}, vocabulary());
  fly(first, flight(room(1), 120, 0.001, 0.01, 2), rng, kSame);
  LoopCloser second(rig(), {}, vocabulary(), first.map());
  const Errors found = fly(second, flight(room(1), 120, 0.001, 0.01, 9, 7.3), rng, kElsewhere, 0, true, Vec3(0.8, 0.5, 0));
  EXPECT_GT(found.known, 100) << "by the places";
  EXPECT_LT(found.m, 0.05);
  EXPECT_TRUE(second.objections().empty()) << "the flight joins all the same";
}

TEST(TagLandmarks, ViewsAreHandedOnWithTheirKeyframes) {
  Rng rng(7);
  LoopCloser closer(rig(), {}, vocabulary());
  fly(closer, flight(room(1), 60, 0, 0, 2), rng, kSame);
  PlaceMap map = closer.map();
  ASSERT_FALSE(map.tags.empty());
  const auto in_M = [&](const MapTag& t) { return Vec3(map.find(t.keyframe)->T_MB * t.T_BT.p); };
  const MapTag last = map.tags.back();
  const Vec3 before = in_M(last);
  map.remove(last.keyframe);
  EXPECT_NE(map.tags.back().keyframe, last.keyframe);
  EXPECT_LT((in_M(map.tags.back()) - before).norm(), 0.01);
  EXPECT_GT(map.tags.back().covariance.trace(), last.covariance.trace());
  change_body(map, {map.cameras[0].q, Vec3(0.1, 0.2, 0.3)});
  EXPECT_LT((in_M(map.tags.back()) - before).norm(), 0.01) << "the tag hangs where it hung";
  take_out_sessions(map, {0});
  EXPECT_TRUE(map.tags.empty());
}

TEST(TagLandmarks, OfATagTheNewestTwelvePassesAreKept) {
  PlaceMap map;
  for (int i = 0; i < 100; ++i) {
    MapKeyframe k;
    k.path_m = i;
    const KeyframeId id = map.add(std::move(k));
    remember_tag(map, {id, 3, {}, (1.0 + (i % 5 == 2 ? 0 : 1)) * Mat6::Identity()});
  }
  ASSERT_EQ(map.tags.size(), 12u);
  EXPECT_TRUE(std::ranges::all_of(map.tags, [](const MapTag& t) { return t.covariance.isIdentity(); })) << "the most certain";
  EXPECT_EQ(map.tags.back().keyframe, KeyframeId{97});
}

/// The map of a flight that recognises nothing but tags, in a frame of its own.
PlaceMap blind_map(std::uint64_t seed, double start_s, const Pose<G, G>& gauge, bool one_tag = false) {
  LoopCloser closer(rig(), {}, vocabulary());
  Rng rng(seed);
  for (const Frame& f : blind(flight(room(1), 120, 0.001, 0.01, seed, start_s))) {
    Keyframe k = keyframe(FrameId{f.t.ns / 1000}, f.t, gauge * f.odometry);
    k.anchors = landmarks(f, rng);
    if (one_tag) std::erase_if(k.anchors, [&](const Anchor& a) { return std::get<TagAnchor>(a).id != 0; });
    closer.process(f.place, k);
  }
  closer.finish();
  return closer.map();
}

TEST(TagLandmarks, MapsThatHaveNothingElseInCommonAreJoinedByThem) {
  const PlaceMap a = blind_map(2, 0, kSame), b = blind_map(9, 7.3, kElsewhere);
  const Result<PlaceMap> both = merge_maps(a, b, {}, vocabulary());
  ASSERT_TRUE(both.ok()) << both.error().message;
  const auto truth_b = flight(room(1), 120, 0, 0, 9, 7.3);
  ASSERT_EQ(both->size(), a.size() + b.size());
  double worst_m = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    const MapKeyframe& k = both->keyframes()[a.size() + i];
    const auto f = std::ranges::find(truth_b, b.keyframes()[i].t, &Frame::t);
    worst_m = std::max(worst_m, (k.T_MB.p - f->truth.p).norm());
  }
  EXPECT_LT(worst_m, 0.15);
  EXPECT_FALSE(merge_maps(a, blind_map(9, 7.3, kElsewhere, true), {}, vocabulary()).ok())
      << "one number may hang in two buildings";
}

}  // namespace loop_closer_tags_test
}  // namespace fbvins
