// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_edit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "fbvins/core/angle.hpp"

namespace fbvins {
namespace {

// Points that were measured by hand, in a map whose scale is good to a percent.
constexpr double kFits_m = 0.3, kFitsInProportion = 0.05;
constexpr double kApart_m = 0.5;

struct Centred {
  Vec3 mean_M = Vec3::Zero(), mean_building = Vec3::Zero();
  double extent_m = 0;  ///< largest horizontal distance of a point from the mean, in the map
};

Centred centre_of(const std::vector<SurveyedPoint>& points) {
  Centred out;
  const double n = static_cast<double>(points.size());
  for (const SurveyedPoint& pair : points) out.mean_M += pair.p_M / n, out.mean_building += pair.p_building / n;
  for (const SurveyedPoint& pair : points) out.extent_m = std::max(out.extent_m, (pair.p_M - out.mean_M).head<2>().norm());
  return out;
}

/// The rotation about the vertical that fits best, in closed form.
double best_heading(const std::vector<SurveyedPoint>& points, const Centred& centre) {
  double sine = 0, cosine = 0;
  for (const SurveyedPoint& pair : points) {
    const Vec3 a = pair.p_M - centre.mean_M, b = pair.p_building - centre.mean_building;
    sine += a.x() * b.y() - a.y() * b.x();
    cosine += a.x() * b.x() + a.y() * b.y();
  }
  return std::atan2(sine, cosine);
}

int loops_of(const PlaceMap& map) {
  return static_cast<int>(
      std::count_if(map.edges.begin(), map.edges.end(), [](const MapEdge& e) { return e.kind == MapEdge::Kind::loop; }));
}

}  // namespace

PlaceMap cut_map(PlaceMap map, const MapBox& box, bool remove_inside) {
  std::vector<KeyframeId> gone;
  for (const MapKeyframe& k : map.keyframes())
    if (box.holds(k.T_MB.p) == remove_inside) gone.push_back(k.id);
  for (const KeyframeId id : gone) map.remove(id);
  return map;
}

Result<MapAlignment> align_map(PlaceMap& map, const std::vector<SurveyedPoint>& points) {
  const auto refuse = [](const std::string& why) { return Error{ErrorCode::invalid_argument, why}; };
  if (map.anchored) return refuse("the map is anchored: its anchors put it into the axes of its building already");
  if (points.size() < 3) return refuse(fmt::format("{} points are given where three are needed", points.size()));
  for (const SurveyedPoint& pair : points)
    if (!pair.p_M.allFinite() || !pair.p_building.allFinite()) return refuse("a point is not finite");
  const Centred centre = centre_of(points);
  if (centre.extent_m < kApart_m)
    return refuse(fmt::format("the points lie within {:.2f} m of one spot: they do not show a heading", centre.extent_m));
  MapAlignment out;
  out.heading_rad = best_heading(points, centre);
  const Quat turn(Eigen::AngleAxisd(out.heading_rad, Vec3::UnitZ()));
  out.moved_m = centre.mean_building - turn * centre.mean_M;
  double squares = 0;
  for (const SurveyedPoint& pair : points) squares += (turn * pair.p_M + out.moved_m - pair.p_building).squaredNorm();
  out.rms_m = std::sqrt(squares / static_cast<double>(points.size()));
  if (out.rms_m > std::max(kFits_m, kFitsInProportion * centre.extent_m))
    return refuse(fmt::format(
        "the points do not fit: {:.2f} m remain (is one of them in other axes, mirrored, or another point?)", out.rms_m));
  const Pose<M, M> T(turn, out.moved_m);
  for (MapKeyframe& k : map.keyframes())
    if (k.placed) k.T_MB = T * k.T_MB;
  return out;
}

MapDifference compare_maps(const PlaceMap& first, const PlaceMap& second) {
  std::multimap<Time, const MapKeyframe*> of_first;
  for (const MapKeyframe& k : first.keyframes()) of_first.emplace(k.t, &k);
  MapDifference out;
  double squares = 0;
  for (const MapKeyframe& k : second.keyframes()) {
    const auto [begin, end] = of_first.equal_range(k.t);
    const auto same =
        std::find_if(begin, end, [&](const auto& other) { return other.second->place.descriptors == k.place.descriptors; });
    if (same == end) {
      ++out.only_second;
      continue;
    }
    ++out.in_both;
    const Pose<M, B>&a = same->second->T_MB, &b = k.T_MB;
    squares += (a.p - b.p).squaredNorm();
    out.largest_m = std::max(out.largest_m, (a.p - b.p).norm());
    out.largest_deg = std::max(out.largest_deg, so3_log(a.q.conjugate() * b.q).norm() / kDegree);
    of_first.erase(same);
  }
  out.only_first = static_cast<int>(of_first.size());
  if (out.in_both > 0) out.rms_m = std::sqrt(squares / out.in_both);
  out.loops_first = loops_of(first), out.loops_second = loops_of(second);
  return out;
}

}  // namespace fbvins
