// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "fbvins/flight/mission.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/yaml_reader.hpp"

namespace fbvins {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr double kFarthest_m = 1000, kLongest_s = 3600, kLargestPlace_m = 200, kLongestWay_m = 100'000;
constexpr std::uint64_t kLargestMission_bytes = 1 << 20;

void read_limits(YamlReader& yaml, const YAML::Node& node, MissionLimits& limits) {
  if (!node.IsDefined()) return;
  yaml.only(node, {"speed", "accel", "jerk", "climb", "land", "yaw_rate"});
  limits.speed_mps = yaml.number_between(node, "speed", 0.05, 10, limits.speed_mps);
  limits.accel_mps2 = yaml.number_between(node, "accel", 0.1, 8, limits.accel_mps2);
  limits.jerk_mps3 = yaml.number_between(node, "jerk", 0.5, 60, limits.jerk_mps3);
  limits.climb_mps = yaml.number_between(node, "climb", 0.1, 2, limits.climb_mps);
  limits.land_mps = yaml.number_between(node, "land", 0.1, 1, limits.land_mps);
  limits.yaw_rate_radps = kRadPerDeg * yaml.number_between(node, "yaw_rate", 5, 120, limits.yaw_rate_radps / kRadPerDeg);
}

void check_near(YamlReader& yaml, const YAML::Node& map, const std::string& field, const std::vector<double>& p) {
  for (double x : p)
    if (std::abs(x) > kFarthest_m) yaml.complain(map, field, fmt::format("is further away than {} m", kFarthest_m));
}

Vec3 point_of(YamlReader& yaml, const YAML::Node& map, const std::string& field) {
  const std::vector<double> p = yaml.numbers(map, field, 3);
  check_near(yaml, map, field, p);
  return {p[0], p[1], p[2]};
}

void read_fence(YamlReader& yaml, const YAML::Node& node, Mission& mission) {
  if (!node.IsDefined()) return;
  yaml.only(node, {"x", "y", "z"});
  if (!yaml.ok()) return;
  Geofence fence;
  constexpr const char* kAxes[] = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i) {
    const std::vector<double> range = yaml.numbers(node, kAxes[i], 2);
    fence.low[i] = range[0];
    fence.high[i] = range[1];
    if (range[0] >= range[1]) yaml.complain(node, kAxes[i], "must go from a smaller to a larger number");
  }
  mission.geofence = fence;
}

void read_place(YamlReader& yaml, const YAML::Node& node, MissionPlace& place) {
  if (!node.IsDefined()) return;
  yaml.only(node, {"kind", "size", "start", "heading"});
  if (!yaml.ok()) return;
  place.kind = yaml.text(node, "kind");
  if (!place.kind.empty() && place.kind != "room" && place.kind != "hall" && place.kind != "corridors")
    yaml.complain(yaml.get(node, "kind"), fmt::format("there is no place '{}'; there are room, hall, corridors", place.kind));
  if (yaml.has(node, "size")) place.size_m = point_of(yaml, node, "size");
  if (place.size_m && place.size_m->minCoeff() < 1) yaml.complain(node, "size", "is too small to fly in");
  if (place.size_m && place.size_m->maxCoeff() > kLargestPlace_m)
    yaml.complain(node, "size", fmt::format("is larger than {} m", kLargestPlace_m));
  if (yaml.has(node, "start")) {
    const std::vector<double> p = yaml.numbers(node, "start", 2);
    place.start_m = {p[0], p[1]};
  }
  place.heading_rad = kRadPerDeg * yaml.number_between(node, "heading", -360, 360, 0);
}

/// `goto: [x, y, z]`, or `goto: {via: [[x, y, z], ...], speed: 1, nose: forward}`.
MissionStep read_goto(YamlReader& yaml, const YAML::Node& map) {
  MissionStep step;
  step.kind = MissionStep::Kind::go;
  const YAML::Node node = yaml.get(map, "goto");
  if (!node.IsMap()) {
    step.points.push_back(point_of(yaml, map, "goto"));
    return step;
  }
  yaml.only(node, {"to", "via", "speed", "nose"});
  if (!yaml.ok()) return step;
  const YAML::Node via = yaml.get(node, "via");
  if (via.IsDefined()) {
    const std::vector<double> p = yaml.numbers(node, "via");
    if (p.empty() || p.size() % 3 != 0) yaml.complain(node, "via", "wants points of three numbers, 21 at most");
    check_near(yaml, node, "via", p);
    for (std::size_t i = 0; i + 2 < p.size(); i += 3) step.points.emplace_back(p[i], p[i + 1], p[i + 2]);
  }
  if (yaml.has(node, "to")) step.points.push_back(point_of(yaml, node, "to"));
  if (step.points.empty()) yaml.complain(node, "goto wants 'to' or 'via'");
  step.speed_mps = yaml.number_between(node, "speed", 0.05, 10, 0);
  const std::string nose = yaml.text(node, "nose");
  if (!nose.empty() && nose != "forward" && nose != "kept") yaml.complain(yaml.get(node, "nose"), "'nose' is forward or kept");
  step.nose_first = nose == "forward";
  return step;
}

MissionStep read_step(YamlReader& yaml, const YAML::Node& node) {
  MissionStep step;
  if (node.IsScalar() && node.Scalar() == "land") {
    step.kind = MissionStep::Kind::land;
  } else if (node.IsScalar() && node.Scalar() == "identify") {
    step.kind = MissionStep::Kind::identify;
  } else if (!node.IsMap() || node.size() != 1) {
    yaml.complain(node, "a step is one of takeoff, goto, hold, yaw, identify, land");
  } else {
    yaml.only(node, {"takeoff", "goto", "hold", "yaw"});
    if (yaml.has(node, "takeoff")) {
      step.kind = MissionStep::Kind::takeoff;
      step.height_m = yaml.number_between(node, "takeoff", 0.2, 100, 1);
    } else if (yaml.has(node, "goto")) {
      step = read_goto(yaml, node);
    } else if (yaml.has(node, "hold")) {
      step.seconds = yaml.number_between(node, "hold", 0, kLongest_s, 0);
    } else if (yaml.has(node, "yaw")) {
      step.kind = MissionStep::Kind::yaw;
      step.yaw_rad = kRadPerDeg * yaml.number_between(node, "yaw", -360, 360, 0);
    }
  }
  step.line = node.Mark().line + 1;
  return step;
}

void read_fault(YamlReader& yaml, const YAML::Node& node, Mission& mission) {
  yaml.only(node, {"stop", "at", "for"});
  if (!yaml.ok()) return;
  MissionFault fault;
  const std::string what = yaml.text(node, "stop");
  if (what == "cameras") fault.what = MissionFault::What::cameras;
  else if (what != "odometry") yaml.complain(node, fmt::format("'stop' is odometry or cameras, not '{}'", what));
  fault.at_s = yaml.number_between(node, "at", 0, kLongest_s, 0);
  fault.for_s = yaml.number_between(node, "for", 0, kLongest_s, 0);
  mission.faults.push_back(fault);
}

/// Takeoff is the first step only, and nothing follows land.
void check_order(YamlReader& yaml, const YAML::Node& steps, const Mission& mission) {
  using Kind = MissionStep::Kind;
  if (mission.steps.empty()) return yaml.complain(steps, "a mission without steps");
  double way_m = 0;
  Vec3 from = Vec3::Zero();
  for (std::size_t i = 0; i < mission.steps.size() && yaml.ok(); ++i) {
    const bool first = i == 0, last = i + 1 == mission.steps.size();
    const MissionStep& step = mission.steps[i];
    if (first && step.kind != Kind::takeoff) yaml.complain(steps[i], "a mission begins with takeoff");
    if (!first && step.kind == Kind::takeoff) yaml.complain(steps[i], "takeoff must be the first step only");
    if (!last && step.kind == Kind::land) yaml.complain(steps[i], "nothing follows after land");
    for (const Vec3& p : step.points) {
      if (p.z() < 0.1) yaml.complain(steps[i], fmt::format("the path leads to z = {} m, into the floor", p.z()));
      way_m += (p - from).norm();
      from = p;
    }
    if (way_m > kLongestWay_m) yaml.complain(steps[i], fmt::format("the path is longer than {} km", kLongestWay_m / 1000));
  }
}

}  // namespace

std::string_view to_string(MissionStep::Kind kind) {
  switch (kind) {
    case MissionStep::Kind::takeoff: return "takeoff";
    case MissionStep::Kind::go: return "goto";
    case MissionStep::Kind::hold: return "hold";
    case MissionStep::Kind::yaw: return "yaw";
    case MissionStep::Kind::identify: return "identify";
    case MissionStep::Kind::land: return "land";
  }
  return "";
}

Result<Mission> parse_mission(const std::string& text, const std::string& source) {
  YamlReader yaml(source, text);
  if (!yaml.ok()) return yaml.error();
  Mission mission;
  mission.source = source;
  const YAML::Node& root = yaml.root();
  yaml.only(root, {"limits", "geofence", "place", "steps", "faults"});
  if (!yaml.ok()) return yaml.error();
  read_limits(yaml, yaml.get(root, "limits"), mission.limits);
  read_fence(yaml, yaml.get(root, "geofence"), mission);
  read_place(yaml, yaml.get(root, "place"), mission.place);
  const YAML::Node steps = yaml.get(root, "steps"), faults = yaml.get(root, "faults");
  if (!steps.IsDefined() || !steps.IsSequence()) yaml.complain(root, "steps", "must be a list");
  if (!yaml.ok()) return yaml.error();
  for (const YAML::Node& node : steps) {
    mission.steps.push_back(read_step(yaml, node));
    if (!yaml.ok()) return yaml.error();
  }
  check_order(yaml, steps, mission);
  if (faults.IsDefined() && !faults.IsSequence()) yaml.complain(root, "faults", "must be a list");
  if (yaml.ok() && faults.IsDefined())
    for (const YAML::Node& node : faults) read_fault(yaml, node, mission);
  if (!yaml.ok()) return yaml.error();
  return mission;
}

Result<Mission> read_mission(const std::string& path) {
  const Result<std::string> text = read_file(path, kLargestMission_bytes);
  if (!text) return text.error();
  return parse_mission(*text, path);
}

}  // namespace fbvins
