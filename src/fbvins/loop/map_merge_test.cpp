// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_merge.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <set>

#include "fbvins/loop/map_file.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins {
namespace map_merge_test {

using namespace test_room;

TEST(MergeMaps, JoinsTwoFlightsOfOneRoomAndRefusesStrangers) {
  const auto map_of = [](std::uint64_t world, std::uint64_t seed, double start_s) {
    LoopCloser closer(rig(), {}, vocabulary());
    for (const Frame& f : flight(room(world), 120, 0.001, 0.01, seed, start_s))
      closer.process(f.place, keyframe(FrameId{f.t.ns / 1000}, f.t, f.odometry));
    closer.finish();
    return closer.map();
  };
  const PlaceMap a = map_of(1, 2, 0), b = map_of(1, 3, 9), stranger = map_of(7, 4, 0);
  const auto both = merge_maps(a, b, {}, vocabulary());
  ASSERT_TRUE(both.ok()) << both.error().message;
  EXPECT_EQ(both->size(), a.size() + b.size());
  // The second flight has a frame of its own: only distances between keyframes of both are comparable.
  const auto truth_a = flight(room(1), 120, 0, 0, 2, 0), truth_b = flight(room(1), 120, 0, 0, 3, 9);
  const Vec3 measured = both->keyframes()[a.size() + 50].T_MB.p - both->keyframes()[60].T_MB.p;
  EXPECT_NEAR(measured.norm(), (truth_b[50].truth.p - truth_a[60].truth.p).norm(), 0.05);
  EXPECT_FALSE(merge_maps(a, stranger, {}, vocabulary()).ok());
  const std::string bytes = serialise_map(b);
  const auto from_file = merge_maps(a, *parse_map(std::as_bytes(std::span(bytes)), "b"), {}, vocabulary());
  ASSERT_TRUE(from_file.ok()) << "words are not kept in files";
  EXPECT_EQ(serialise_map(*from_file), serialise_map(*both));
  const auto twice = merge_maps(a, a, {}, vocabulary());
  ASSERT_FALSE(twice.ok()) << "a map merged with itself";
  EXPECT_EQ(twice.error().message, fmt::format("{0} of its {0} keyframes are in the other map already", a.size()));
  EXPECT_FALSE(merge_maps(*both, b, {}, vocabulary()).ok()) << "a part of itself";
  PlaceMap boosted = b;
  boosted.boosted = true;
  EXPECT_FALSE(merge_maps(a, boosted, {}, vocabulary()).ok()) << "descriptors of two kinds do not compare";
}

TEST(MergeMaps, PartsOfOneFlightMayOverlap) {
  const std::vector<Frame> frames = flight(room(1), 170, 0.001, 0.01, 2, 0);
  const auto part = [&](std::size_t begin, std::size_t end) {
    LoopCloser closer(rig(), {}, vocabulary());
    for (std::size_t i = begin; i < end; ++i)
      closer.process(frames[i].place, keyframe(FrameId{frames[i].t.ns / 1000}, frames[i].t, frames[i].odometry));
    closer.finish();
    return closer.map();
  };
  const PlaceMap a = part(0, 100), b = part(80, 170);
  const auto both = merge_maps(a, b, {}, vocabulary());
  ASSERT_TRUE(both.ok()) << both.error().message;
  EXPECT_EQ(both->size(), a.size() + b.size() - 20);
  std::set<std::int64_t> stamps;
  for (const MapKeyframe& k : both->keyframes()) EXPECT_TRUE(stamps.insert(k.t.ns).second) << "a keyframe is there twice";
  EXPECT_FALSE(merge_maps(a, part(0, 60), {}, vocabulary()).ok()) << "nothing of its own";
}

}  // namespace map_merge_test
}  // namespace fbvins
