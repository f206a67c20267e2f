// SPDX-License-Identifier: Apache-2.0
// The synthetic world: textured parallelograms, lamps, moving things. z up, floor at z = 0.
// Immutable once built, any thread.
//
//   World world = build_world(options, plan, path, seed);
//   std::vector<Facet> now = world.facets;   append_movers(world, t, now)
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fbvins/geometry/so3.hpp"
#include "fbvins/sim/floor_plan.hpp"
#include "fbvins/sim/texture.hpp"

namespace fbvins {

/// A parallelogram corner + a * u + b * v, a and b in [0, 1]; seen from where u x v points.
struct Facet {
  Vec3 corner = Vec3::Zero(), u = Vec3::UnitX(), v = Vec3::UnitY();
  int texture = 0;
  float repeat_u = 1, repeat_v = 1;  ///< copies of the texture along u and v
  float shift_u = 0, shift_v = 0;    ///< start inside the texture, in copies
  float tint = 1;                    ///< factor of the texture's reflectance
  float detail = 0.15f;              ///< strength of the fine grain, visible at short distance
  float gloss = 0;                   ///< strength of the lamps' mirror images
  float emission = 0;                ///< light of its own, same scale as reflected light under irradiance 1
  int lamp_group = -1;               ///< of a lamp's surface, which is dimmed with this group; -1: none

  Vec3 normal() const { return u.cross(v).normalized(); }
  Vec3 centre() const { return corner + 0.5 * (u + v); }
};

/// Lamps are switched and dimmed by group; kAmbient is the ambient light.
enum LightGroup : int { kLampsA, kLampsB, kAmbient, kLightGroups };

struct Lamp {
  Vec3 p = Vec3::Zero();
  double power = 1;  ///< irradiance at 1 m, on a surface that faces it
  int group = kLampsA;
};

/// A rigid thing that moves to and fro between two places.
struct Mover {
  std::vector<Facet> facets;  ///< around its own origin
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();
  double round_trip_s = 10, phase_rad = 0, spin_radps = 0;
  double radius_m = 0.5;

  Vec3 position(double t_s) const;
  Quat rotation(double t_s) const;
};

struct WorldOptions {
  std::string kind = "room";
  double margin_m = 1.8;
  double height_m = 3.2;
  double plain_share = 0.74;
  double weave_share = 0.55;
  double posters_per_m2 = 0.1;
  double clutter_per_m2 = 0.7;
  double tangles_per_m2 = 0.3;
  double repeat_share = 0.2;
  double clearance_m = 0.55;
  double lamp_spacing_m = 2.6;
  double ambient = 0.45;
  double detail = 1.0;
  double gloss = 0.0;
  double lamp_glow = 2.5;
  double window_glow = 1.6;
  double window_share = 0.6;
  double floor_marks = 0.45;
  int movers = 0;

  template <class V>
  void visit(V&& v) {
    v("kind", kind, "room|hall|corridors", "one room; a higher one with pillars; rooms around a ring of corridors");
    v("margin_m", margin_m, "m", "from the flight to the walls (room, hall)", 0.7, 50.0);
    v("height_m", height_m, "m", "of the ceiling, or more where the flight needs it", 2.2, 30.0);
    v("plain_share", plain_share, "", "share of surfaces with almost no texture", 0.0, 1.0);
    v("weave_share", weave_share, "", "share of those that are woven: fine corners that all look the same", 0.0, 1.0);
    v("posters_per_m2", posters_per_m2, "1/m^2", "posters, pages and pictures on walls", 0.0, 5.0);
    v("clutter_per_m2", clutter_per_m2, "1/m^2", "boxes and furniture on the floor", 0.0, 10.0);
    v("tangles_per_m2", tangles_per_m2, "1/m^2", "plants, tripods, chairs and cables: thin rods in front of one another", 0.0,
      5.0);
    v("repeat_share", repeat_share, "", "share of walls with equal things at equal distances", 0.0, 1.0);
    v("clearance_m", clearance_m, "m", "least distance of things from the flight", 0.1, 10.0);
    v("lamp_spacing_m", lamp_spacing_m, "m", "of the lamps under the ceiling", 0.8, 50.0);
    v("ambient", ambient, "", "share of ambient light", 0.0, 1.0);
    v("detail", detail, "", "strength of fine grain, visible at short distance", 0.0, 2.0);
    v("gloss", gloss, "", "mirror images of lamps on floor and furniture", 0.0, 10.0);
    v("lamp_glow", lamp_glow, "", "brightness of a lamp's own surface", 0.0, 100.0);
    v("window_glow", window_glow, "", "brightness of the sky in windows", 0.0, 100.0);
    v("window_share", window_share, "", "share of possible windows that are there", 0.0, 1.0);
    v("floor_marks", floor_marks, "1/m^2", "mats, tapes and papers on the floor", 0.0, 10.0);
    v("movers", movers, "", "walking people and moving boxes", 0, 100);
  }
};

/// The facets of one thing that people move: a shelf, a table with what lies on it, a stack of boxes, a tangle of rods.
struct FurniturePiece {
  std::size_t first = 0, count = 0;
};

struct World {
  FloorPlan plan;
  TextureAtlas atlas;
  int detail_texture = 0;
  std::vector<Facet> facets;
  std::vector<FurniturePiece> furniture;
  std::vector<Lamp> lamps;
  std::vector<Mover> movers;
};

/// `path`: positions of the cameras over time, which are kept clear.
World build_world(const WorldOptions& options, const FloorPlan& plan, const std::vector<Vec3>& path, std::uint64_t seed);

/// The movers' facets at an instant, but for those that would touch a camera at `camera`.
void append_movers(const World& world, double t_s, const Vec3& camera, std::vector<Facet>& facets);

}  // namespace fbvins
