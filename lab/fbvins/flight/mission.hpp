// SPDX-License-Identifier: Apache-2.0
// A mission: a short list of steps, motion limits, the place where it is flown, and faults to inject.
//
//   Result<Mission> mission = read_mission("configs/missions/paper.yaml");
//   if (!mission) return report(mission.error().message);       // "paper.yaml:7: ..."
//
// Positions are in the mission's frame L, in metres: origin and x axis are the vehicle's position and heading before take-off, z
// is up. Pure functions, any thread.
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

/// A box in L that the vehicle must not leave.
struct Geofence {
  Vec3 low, high;
  bool contains(const Vec3& p) const { return (p.array() >= low.array()).all() && (p.array() <= high.array()).all(); }
};

/// Where the mission is flown; what is not given is the simulator preset's.
struct MissionPlace {
  std::string kind;             ///< room, hall, corridors; empty: the preset's
  std::optional<Vec3> size_m;   ///< of the room, centred over the world's origin; of the ring of corridors
  Vec2 start_m = Vec2::Zero();  ///< in the world
  double heading_rad = 0;       ///< in the world
};

struct MissionStep {
  enum class Kind { takeoff, go, hold, yaw, identify, land };
  Kind kind = Kind::hold;
  std::vector<Vec3> points;  ///< of go: corners of the path, all but the last rounded
  double height_m = 0;       ///< of takeoff
  double seconds = 0;        ///< of hold
  double yaw_rad = 0;        ///< of yaw
  bool nose_first = false;   ///< of go: the heading follows the path
  double speed_mps = 0;      ///< of go; 0: the limit
  int line = 0;              ///< in the file
};

/// A fault injected in flight.
struct MissionFault {
  enum class What {
    odometry,  ///< no pose reaches the controller
    cameras,   ///< no image reaches the odometry
  };
  What what = What::odometry;
  double at_s = 0;   ///< since the beginning of take-off
  double for_s = 0;  ///< 0: to the end
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

/// The error is one sentence with file and line: wrong syntax or values, or an impossible order of steps (no takeoff, say).
Result<Mission> parse_mission(const std::string& text, const std::string& source);
Result<Mission> read_mission(const std::string& path);

/// Points along the mission in L, 0.25 m apart at most, each with the index of its step.
struct MissionPoint {
  Vec3 p;
  int step = 0;
};
std::vector<MissionPoint> path_points(const Mission& mission);

/// Bound on a mission's duration: twice the time of every leg at its slowest limit, and time to spare.
double longest_flight_s(const Mission& mission);

/// The mission's own fence, or a box with a margin of 1.5 m around its path.
Geofence fence_of(const Mission& mission);

/// T_WL and the floor plan. The origin is the centre of the standing vehicle.
struct MissionSite {
  FloorPlan plan;
  Vec3 origin_W = Vec3::Zero();
  double heading_rad = 0;
  Vec3 to_world(const Vec3& p_L) const { return origin_W + so3_exp(Vec3(0, 0, heading_rad)) * p_L; }
};

/// Options of the simulator for what the mission's place does not give.
struct PlaceDefaults {
  std::string kind = "room";
  double margin_m = 1.8, height_m = 3.2;
  double extent_x_m = 12, extent_y_m = 8;  ///< of corridors
};
/// Error, in one sentence, if the mission's path is too near to a wall or the ceiling, or leaves its own geofence.
Result<MissionSite> site_of(const Mission& mission, const PlaceDefaults& defaults, double standing_height_m);

}  // namespace fbvins
