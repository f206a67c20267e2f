// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_edit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "fbvins/core/angle.hpp"
#include "fbvins/loop/map_frame.hpp"

namespace fbvins {
namespace {

// Points that were measured by hand, in a map whose scale is good to a percent.
constexpr double kFits_m = 0.3, kFitsInProportion = 0.05;
constexpr double kApart_m = 0.5;

/// Largest horizontal distance of a point from the mean, in the map.
double extent_m(const std::vector<SurveyedPoint>& points) {
  Vec3 mean_M = Vec3::Zero();
  for (const SurveyedPoint& pair : points) mean_M += pair.p_M / static_cast<double>(points.size());
  double out = 0;
  for (const SurveyedPoint& pair : points) out = std::max(out, (pair.p_M - mean_M).head<2>().norm());
  return out;
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
  const double extent = extent_m(points);
  if (extent < kApart_m)
    return refuse(fmt::format("the points lie within {:.2f} m of one spot: they do not show a heading", extent));
  std::vector<Pose<M, B>> in_map, in_building;  // without attitudes
  for (const SurveyedPoint& pair : points)
    in_map.push_back({Quat::Identity(), pair.p_M}), in_building.push_back({Quat::Identity(), pair.p_building});
  const Pose<M, M> T = nearest_to(in_building, in_map, 0);
  MapAlignment out;
  out.heading_rad = yaw_of(T.q);
  out.moved_m = T.p;
  double squares = 0;
  for (const SurveyedPoint& pair : points) squares += (T * pair.p_M - pair.p_building).squaredNorm();
  out.rms_m = std::sqrt(squares / static_cast<double>(points.size()));
  if (out.rms_m > std::max(kFits_m, kFitsInProportion * extent))
    return refuse(fmt::format(
        "the points do not fit: {:.2f} m remain (is one of them in other axes, mirrored, or another point?)", out.rms_m));
  map.move(T);
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
