// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/landmark_memory.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace landmark_memory_test {

constexpr int kLevels = 3;
const Camera kCamera(PinholeRadtan{.fx = 400, .fy = 400, .cx = 320, .cy = 240}, 640, 480);

/// Seen from the origin, 4 m along z.
RememberedLandmark landmark(std::int64_t track, const Vec3& p_G = Vec3(0, 0, 4)) {
  RememberedLandmark l;
  l.track = TrackId{track};
  l.level = 1;
  l.p_G = p_G;
  return l;
}

std::vector<ExpectedLandmark> expected_from(const LandmarkMemory& memory, const Vec3& p_G, const Vec3& turn = Vec3::Zero()) {
  std::vector<ExpectedLandmark> out;
  memory.expect({so3_exp(turn), p_G}, kCamera, kLevels, out);
  return out;
}

TEST(LandmarkMemory, ExpectsALandmarkWhereItProjects) {
  LandmarkMemory memory(3000);
  memory.keep(landmark(3));
  const auto same = expected_from(memory, Vec3::Zero());
  ASSERT_EQ(same.size(), 1u);
  EXPECT_LT((same[0].px - Vec2(320, 240)).norm(), 1e-9);
  EXPECT_EQ(same[0].level, 1);
  EXPECT_DOUBLE_EQ(same[0].depth_m, 4);
  const auto aside = expected_from(memory, Vec3(0.5, 0, 0));
  ASSERT_EQ(aside.size(), 1u);
  EXPECT_LT((aside[0].px - Vec2(320 - 50, 240)).norm(), 1e-9);
  // From nearer it looks larger and is on a coarser level; from farther away on a finer one.
  EXPECT_EQ(expected_from(memory, Vec3(0, 0, 0.8)).at(0).level, 2);
  EXPECT_EQ(expected_from(memory, Vec3(0, 0, -1)).at(0).level, 0);
}

TEST(LandmarkMemory, ExpectsNoneFromAnotherDirectionOrDistance) {
  LandmarkMemory memory(3000);
  memory.keep(landmark(3));
  const auto seen_at_angle = [&](double angle) {  // from 4 m away, looking at it
    return expected_from(memory, Vec3(-4 * std::sin(angle), 0, 4 - 4 * std::cos(angle)), Vec3(0, angle, 0)).size();
  };
  EXPECT_EQ(seen_at_angle(kMaxViewAngle_rad - 0.01), 1u);
  EXPECT_EQ(seen_at_angle(kMaxViewAngle_rad + 0.01), 0u);
  EXPECT_EQ(expected_from(memory, Vec3(0, 0, 4 - 4 * (kSmallestViewScale + 0.01))).size(), 1u);
  EXPECT_EQ(expected_from(memory, Vec3(0, 0, 4 - 4 * (kSmallestViewScale - 0.01))).size(), 0u) << "too near";
  EXPECT_EQ(expected_from(memory, Vec3(0, 0, 4 - 4 / (kSmallestViewScale - 0.01))).size(), 0u) << "too far";
  EXPECT_EQ(expected_from(memory, Vec3(0, 0, 5)).size(), 0u) << "behind";
  EXPECT_EQ(expected_from(memory, Vec3(0, 0, 0), Vec3(0, 1.2, 0)).size(), 0u) << "out of the image";
}

TEST(LandmarkMemory, WaitsForThePosition) {
  LandmarkMemory memory(3000);
  for (const std::int64_t track : {1, 2}) {
    RememberedLandmark l = landmark(track);
    l.p_G.reset();
    memory.keep(l);
  }
  EXPECT_TRUE(expected_from(memory, Vec3::Zero()).empty());
  memory.locate(TrackId{2}, Vec3(0, 0, 4));
  memory.locate(TrackId{9}, Vec3(0, 0, 4));  // of one that is not here
  const auto located = expected_from(memory, Vec3::Zero());
  ASSERT_EQ(located.size(), 1u);
  EXPECT_EQ(located[0].landmark->track, TrackId{2});
  memory.forget_unlocated(Time{60'000'000'000});
  EXPECT_EQ(memory.size(), 1u);
  memory.take_out(TrackId{2});
  EXPECT_EQ(memory.size(), 0u);
}

TEST(LandmarkMemory, IsBoundedAndForgetsThoseUnseenForLongest) {
  LandmarkMemory memory(3);
  for (const std::int64_t track : {5, 1, 4, 2, 3}) {
    RememberedLandmark l = landmark(track);
    l.kept = Time{10 * (track == 1 ? 7 : track)};  // track 1 was seen again last
    memory.keep(l);
  }
  const auto left = expected_from(memory, Vec3::Zero());
  ASSERT_EQ(left.size(), 3u);
  EXPECT_EQ(left[0].landmark->track, TrackId{1});
  EXPECT_EQ(left[1].landmark->track, TrackId{4});
  EXPECT_EQ(left[2].landmark->track, TrackId{5});
  memory.clear();
  EXPECT_EQ(memory.size(), 0u);
}

}  // namespace landmark_memory_test
}  // namespace fbvins
