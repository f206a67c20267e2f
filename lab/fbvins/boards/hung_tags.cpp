// SPDX-License-Identifier: Apache-2.0
#include "fbvins/boards/hung_tags.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fbvins/calibration/tag_family.hpp"

namespace fbvins {
namespace {

constexpr int kCells = 10;  ///< of the paper's edge: the tag's 8 and a white one on both sides
constexpr double kFromWall_m = 0.03, kStep_m = 0.25, kApart_m = 2, kSample_s = 0.5;
/// Where a camera sees a tag well: nearer than so many of its edges, and not from the side or at the image's border.
constexpr double kFarthest_sizes = 16, kNearest_m = 0.5, kLeastCosine = 0.5, kWidest = 0.6, kHighest = 0.4;
constexpr int kFewestViews = 3;

struct Place {
  Vec3 p = Vec3::Zero(), face = Vec3::UnitX();  ///< in the world
  int views = 0;
};

bool hides(const Facet& f, const Vec3& from, const Vec3& to) {
  const Vec3 n = f.u.cross(f.v), way = to - from;
  const double speed = n.dot(way);
  if (std::abs(speed) < 1e-12) return false;
  const double share = n.dot(f.corner - from) / speed;
  if (share <= 0 || share >= 1) return false;
  const Vec3 on = from + share * way - f.corner;
  const double a = f.v.cross(n).dot(on) / f.v.cross(n).dot(f.u), b = n.cross(f.u).dot(on) / n.cross(f.u).dot(f.v);
  return a >= 0 && a <= 1 && b >= 0 && b <= 1;
}

bool sees(const World& world, const Pose<W, C0>& T_WC, const Place& place, double size_m) {
  const Vec3 p_C = T_WC.inverse() * place.p;
  const Vec3 to_camera = T_WC.p - place.p;
  if (p_C.z() < kNearest_m || p_C.norm() > kFarthest_sizes * size_m) return false;
  if (std::abs(p_C.x()) > kWidest * p_C.z() || std::abs(p_C.y()) > kHighest * p_C.z()) return false;
  if (to_camera.dot(place.face) < kLeastCosine * to_camera.norm()) return false;
  const Vec3 right = Vec3::UnitZ().cross(place.face);
  for (const double side : {-0.5, 0.5})
    for (const double up : {-0.5, 0.5}) {
      const Vec3 corner = place.p + size_m * (side * right + up * Vec3::UnitZ());
      if (std::ranges::any_of(world.facets, [&](const Facet& f) { return hides(f, T_WC.p, corner); })) return false;
    }
  return true;
}

std::vector<Place> possible_places(const World& world, const Simulation& s, double size_m) {
  std::vector<Pose<W, C0>> cameras;
  for (double t = 0; t < s.flight.duration_s(); t += kSample_s) {
    const Pose<W, C0> T = s.flight.pose(t) * s.rig.T_BC0();
    cameras.push_back({T.q, Vec3(T.p + s.world_from_flight)});
  }
  std::vector<Place> out;
  for (const WallRun& run : wall_runs(world.plan)) {
    const Vec3 a(run.a.x(), run.a.y(), 0), along(run.b.x() - run.a.x(), run.b.y() - run.a.y(), 0);
    const Vec3 face = Vec3::UnitZ().cross(along.normalized());  // the free side is to the left
    for (double at = size_m; at < along.norm() - size_m; at += kStep_m)
      for (double height = 0.8; height < std::min(2.2, world.plan.height_m - size_m); height += 2 * kStep_m) {
        Place place{a + at * along.normalized() + Vec3(0, 0, height) + kFromWall_m * face, face};
        for (const Pose<W, C0>& camera : cameras) place.views += sees(world, camera, place, size_m);
        if (place.views >= kFewestViews) out.push_back(place);
      }
  }
  return out;
}

/// Rows from the top: a facet shows its texture upright where v points down and u to the left (renderer.cpp). Edges of cells lie
/// at fifths of a texel.
Canvas paper(const TagCells& cells) {
  constexpr int kParts = 5;
  static_assert(kTextureSize * kParts % kCells == 0);
  const auto cell_at = [](int part) { return part * kCells / (kTextureSize * kParts) - 1; };
  const auto is_black = [&](int column, int row) {
    const bool on_tag = column >= 0 && column < 8 && row >= 0 && row < 8;
    return on_tag && cells[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
  };
  Canvas out;
  for (int y = 0; y < kTextureSize; ++y)
    for (int x = 0; x < kTextureSize; ++x) {
      int black = 0;
      for (int j = 0; j < kParts; ++j)
        for (int i = 0; i < kParts; ++i) black += is_black(cell_at(x * kParts + i), cell_at(y * kParts + j)) ? 1 : 0;
      out.at(x, y) = 0.9f - 0.84f * static_cast<float>(black) / (kParts * kParts);
    }
  return out;
}

void hang(World& world, const Place& place, const TagCells& cells, double size_m) {
  const double edge_m = size_m * kCells / 8;
  Facet f;
  f.u = edge_m * place.face.cross(Vec3::UnitZ());
  f.v = -edge_m * Vec3::UnitZ();
  f.corner = place.p - 0.5 * (f.u + f.v);
  f.texture = world.atlas.add(paper(cells));
  f.detail = 0;
  world.facets.push_back(f);
}

}  // namespace

Result<TagSurvey> hang_tags(World& world, const Simulation& simulation, int count, double size_m) {
  TagSurvey survey{.size_m = size_m, .T_AT = {}};
  std::vector<Place> places = possible_places(world, simulation, size_m);
  std::ranges::stable_sort(places, std::ranges::greater{}, &Place::views);
  for (int id = 0; id < count; ++id) {
    if (places.empty())
      return Error{ErrorCode::invalid_argument,
                   fmt::format("the flight sees {} places for tags of {} m, not {}", id, size_m, count)};
    const Result<TagCells> cells = tag_cells(id);
    if (!cells) return cells.error();
    const Place best = places.front();
    hang(world, best, *cells, size_m);
    survey.T_AT[id] = {upright_facing(std::atan2(best.face.y(), best.face.x())), Vec3(best.p - simulation.world_from_flight)};
    std::erase_if(places, [&](const Place& p) { return (p.p - best.p).norm() < kApart_m; });
  }
  return survey;
}

}  // namespace fbvins
