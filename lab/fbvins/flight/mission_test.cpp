// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/mission.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace fbvins {
namespace mission_test {

constexpr const char* kGood = R"(limits: {speed: 0.8, accel: 1.5, jerk: 6, yaw_rate: 60}
geofence: {x: [-1, 3], y: [-1, 2], z: [-0.5, 2]}
place: {kind: room, size: [8, 6, 3], start: [-2, 0], heading: 90}
steps:
  - takeoff: 0.6
  - goto: [0.6, 0, 0.6]
  - goto: {via: [[1, 0, 1], [1, 1, 1]], to: [0.5, 1, 0.8], speed: 0.3, nose: forward}
  - yaw: -90
  - hold: 2.5
  - land
faults:
  - {stop: odometry, at: 5, for: 1}
  - {stop: cameras, at: 9}
)";

std::string complaint(const std::string& text) {
  const Result<Mission> mission = parse_mission(text, "m.yaml");
  return mission ? "" : mission.error().message;
}

std::string site_complaint(const std::string& text) {
  const Result<Mission> mission = parse_mission(text, "m.yaml");
  EXPECT_TRUE(mission) << mission.error().message;
  const Result<MissionSite> site = site_of(*mission, {}, 0.2);
  return site ? "" : site.error().message;
}

TEST(Mission, IsReadWithAllItsParts) {
  const Result<Mission> mission = parse_mission(kGood, "m.yaml");
  ASSERT_TRUE(mission) << mission.error().message;
  ASSERT_EQ(mission->steps.size(), 6u);
  EXPECT_EQ(mission->steps[0].height_m, 0.6);
  EXPECT_EQ(mission->steps[1].points.front(), Vec3(0.6, 0, 0.6));
  EXPECT_EQ(mission->steps[2].points.size(), 3u);
  EXPECT_TRUE(mission->steps[2].nose_first);
  EXPECT_EQ(mission->steps[2].speed_mps, 0.3);
  EXPECT_EQ(mission->steps[2].line, 7);
  EXPECT_NEAR(mission->steps[3].yaw_rad, -std::numbers::pi / 2, 1e-12);
  EXPECT_EQ(mission->steps[4].seconds, 2.5);
  EXPECT_EQ(mission->limits.speed_mps, 0.8);
  EXPECT_NEAR(mission->place.heading_rad, std::numbers::pi / 2, 1e-12);
  ASSERT_EQ(mission->faults.size(), 2u);
  EXPECT_EQ(mission->faults[0].what, MissionFault::What::odometry);
  EXPECT_EQ(mission->faults[1].for_s, 0);
  EXPECT_EQ(site_complaint(kGood), "");
}

TEST(Mission, ASlowLegHasTheTimeThatItTakes) {
  const auto mission = parse_mission("steps:\n  - takeoff: 1\n  - goto: {to: [20, 0, 1], speed: 0.05}\n  - land\n", "m.yaml");
  ASSERT_TRUE(mission) << mission.error().message;
  EXPECT_GT(longest_flight_s(*mission), 20 / 0.05);
}

TEST(Mission, AnErrorIsOneSentenceWithItsLine) {
  const std::string up = "steps:\n  - takeoff: 1\n";
  EXPECT_EQ(complaint("steps: []\n").substr(0, 9), "m.yaml:1:");
  EXPECT_NE(complaint(up + "  - fly: 1\n").find("m.yaml:3: unknown key 'fly'"), std::string::npos);
  EXPECT_NE(complaint("steps:\n  - hold: 1\n").find("m.yaml:2: a mission begins with takeoff"), std::string::npos);
  EXPECT_NE(complaint(up + "  - land\n  - hold: 1\n").find("m.yaml:3: nothing follows after land"), std::string::npos);
  EXPECT_NE(complaint(up + "  - takeoff: 2\n").find("m.yaml:3:"), std::string::npos);
  EXPECT_NE(complaint(up + "  - goto: [1, 2]\n").find("3 are needed"), std::string::npos);
  EXPECT_NE(complaint(up + "  - goto: [1, 2, -1]\n").find("into the floor"), std::string::npos);
  EXPECT_NE(complaint(up + "  - goto: {to: [1, 1, 1], nose: up}\n").find("'nose' is forward or kept"), std::string::npos);
  EXPECT_NE(complaint(up + "limits: {speed: -1}\n").find("'speed' must be a number"), std::string::npos);
  EXPECT_NE(complaint(up + "geofence: {x: [1, 0], y: [0, 1], z: [0, 1]}\n").find("from a smaller to a larger"),
            std::string::npos);
  EXPECT_NE(complaint(up + "place: {kind: cave}\n").find("there is no place 'cave'"), std::string::npos);
  EXPECT_NE(complaint(up + "faults:\n  - {stop: gravity}\n").find("m.yaml:4:"), std::string::npos);
  EXPECT_NE(complaint("takeoff: 1\n").find("unknown key 'takeoff'"), std::string::npos);
  EXPECT_NE(complaint("- 1\n"), "");
  EXPECT_NE(complaint("steps: [\n"), "");
  EXPECT_EQ(read_mission("nowhere.yaml").error().code, ErrorCode::not_found);
}

TEST(Mission, APathThroughAWallIsRefused) {
  const std::string room = "place: {kind: room, size: [4, 4, 3]}\nsteps:\n  - takeoff: 1\n";
  EXPECT_EQ(site_complaint(room + "  - goto: [1.4, 0, 1]\n"), "");
  EXPECT_NE(site_complaint(room + "  - goto: [2.5, 0, 1]\n").find("m.yaml:4: the path leads through a wall"), std::string::npos);
  EXPECT_NE(site_complaint(room + "  - goto: [1.7, 0, 1]\n").find("too near"), std::string::npos);
  EXPECT_NE(site_complaint(room + "  - goto: [1, 0, 2.6]\n").find("ceiling"), std::string::npos);
  const std::string fenced = "geofence: {x: [-1, 1], y: [-1, 1], z: [-1, 2]}\n" + room;
  EXPECT_NE(site_complaint(fenced + "  - goto: [1.2, 0, 1]\n").find("m.yaml:5: the path leads out of the geofence"),
            std::string::npos);
  // Along a corridor of the ring, and across its inner yard.
  const std::string ring = "place: {kind: corridors, size: [12, 8, 3], start: [-6, -4]}\nsteps:\n  - takeoff: 1\n";
  EXPECT_EQ(site_complaint(ring + "  - goto: [12, 0, 1]\n"), "");
  EXPECT_NE(site_complaint(ring + "  - goto: [12, 8, 1]\n").find("wall"), std::string::npos);
}

TEST(Mission, TheDefaultGeofenceSurroundsThePath) {
  const Geofence fence = fence_of(*parse_mission("steps:\n  - takeoff: 1\n  - goto: [2, -1, 1.5]\n", "m.yaml"));
  EXPECT_TRUE(fence.contains({3, -2, 2.5}));
  EXPECT_FALSE(fence.contains({4, 0, 1}));
  EXPECT_FALSE(fence.contains({0, 0, 3.5}));
  EXPECT_EQ(fence_of(*parse_mission(kGood, "m.yaml")).high.x(), 3);
}

TEST(Mission, PlannedPlacesFollowTheSteps) {
  const Mission mission = *parse_mission("steps:\n  - takeoff: 1\n  - goto: [2, 0, 1]\n  - land\n", "m.yaml");
  const std::vector<MissionPoint> places = path_points(mission);
  EXPECT_EQ(places.front().p, Vec3(0, 0, 0));
  EXPECT_EQ(places.back().p, Vec3(2, 0, 0));
  for (std::size_t i = 1; i < places.size(); ++i) EXPECT_LE((places[i].p - places[i - 1].p).norm(), 0.25 + 1e-9);
}

}  // namespace mission_test
}  // namespace fbvins
