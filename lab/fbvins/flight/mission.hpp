// SPDX-License-Identifier: Apache-2.0
// What a vehicle shall do: a short list of steps, the limits that it keeps, the place where it flies, and what shall fail there.
//
//   Result<Mission> mission = read_mission("configs/missions/paper.yaml");
//   if (!mission) return report(mission.error().message);       // "paper.yaml:7: ..."
//
// Places are in the mission's frame L: origin where the vehicle stood, x its heading then, z up, metres. Pure functions, any
// thread.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/sim/floor_plan.hpp"

namespace fbvins {

struct MissionLimits {
  double speed_mps = 0.5, accel_mps2 = 1.0, jerk_mps3 = 4.0;
  double climb_mps = 0.4, land_mps = 0.3;
  double yaw_rate_radps = 0.7;
};

/// A box in L that is never left.
struct Geofence {
  Vec3 low, high;
  bool contains(const Vec3& p) const { return (p.array() >= low.array()).all() && (p.array() <= high.array()).all(); }
};

/// Where the mission is flown: the world's kind and size as a preset's, if nothing is said here.
struct MissionPlace {
  std::string kind;             ///< room, hall, corridors; empty: the preset's
  std::optional<Vec3> size_m;   ///< of the room, centred over the world's origin; of the ring of corridors
  Vec2 start_m = Vec2::Zero();  ///< in the world
  double heading_rad = 0;       ///< in the world
};

struct MissionStep {
  enum class Kind { takeoff, go, hold, yaw, identify, land };
  Kind kind = Kind::hold;
  std::vector<Vec3> points;  ///< of go: corners of the way, rounded but the last
  double height_m = 0;       ///< of takeoff
  double seconds = 0;        ///< of hold
  double yaw_rad = 0;        ///< of yaw
  bool nose_first = false;   ///< of go: the nose turns along the way
  double speed_mps = 0;      ///< of go; 0: the limit
  int line = 0;              ///< in the file
};

/// What stops working in flight.
struct MissionFault {
  enum class What {
    odometry,  ///< no pose reaches the controller
    cameras,   ///< no image reaches the odometry
  };
  What what = What::odometry;
  double at_s = 0;   ///< after take-off began
  double for_s = 0;  ///< 0: for good
};

struct Mission {
  std::string source;  ///< the file, for messages
  MissionLimits limits;
  std::optional<Geofence> geofence;
  MissionPlace place;
  std::vector<MissionStep> steps;
  std::vector<MissionFault> faults;
};

std::string_view to_string(MissionStep::Kind kind);

/// One sentence with file and line where it says something wrong or its steps do not fit together (it must take off first, say).
Result<Mission> parse_mission(const std::string& text, const std::string& source);
Result<Mission> read_mission(const std::string& path);

/// Places along the mission in L, half a metre apart at most, each with the step that leads there.
struct PlannedPlace {
  Vec3 p;
  int step = 0;
};
std::vector<PlannedPlace> planned_places(const Mission& mission);

/// The mission's own, or a box around its way.
Geofence fence_of(const Mission& mission);

/// Where L is in the world: the vehicle stands with its centre at `height_m` over the floor.
struct MissionSite {
  FloorPlan plan;
  Vec3 origin_W = Vec3::Zero();
  double heading_rad = 0;
  Vec3 to_world(const Vec3& p_L) const { return origin_W + so3_exp(Vec3(0, 0, heading_rad)) * p_L; }
};

/// What the world is, if the mission does not say: an option of the simulator.
struct PlaceDefaults {
  std::string kind = "room";
  double margin_m = 1.8, height_m = 3.2;
  double extent_x_m = 12, extent_y_m = 8;  ///< of corridors
};
/// The rooms. One sentence where the way of the mission leads through a wall, the floor, the ceiling or the fence.
Result<MissionSite> site_of(const Mission& mission, const PlaceDefaults& defaults, double standing_height_m);

}  // namespace fbvins
