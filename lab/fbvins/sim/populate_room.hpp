// SPDX-License-Identifier: Apache-2.0
// Contents of a room: walls with pictures, furniture, boxes, lamps, people. Used by build_world only;
// one thread.
#pragma once

#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/sim/paint.hpp"
#include "fbvins/sim/world.hpp"

namespace fbvins {

/// Axes and sizes of a box in space.
struct BoxShape {
  Vec3 centre = Vec3::Zero(), half = Vec3::Constant(0.1);
  Quat q = Quat::Identity();
};

/// Adds the facets of the six sides. Textures repeat every `texture_m` metres; smaller sides show a part.
void add_box(std::vector<Facet>& facets, const BoxShape& shape, int texture, float tint, double texture_m);

/// Chooses surfaces at random and adds facets to a world.
class RoomPopulator {
 public:
  RoomPopulator(World& world, const WorldOptions& options, const std::vector<Vec3>& path, std::uint64_t seed);

  void build_shell();  ///< walls, floor, ceiling
  void hang_pictures();
  void place_furniture();
  void cover_floors();  ///< with mats, tapes, papers
  void hang_lamps();
  void add_movers();

 private:
  struct Wall {
    Vec3 corner, along, down;  ///< from the upper corner; along x down points into the room
    double length() const { return along.norm(); }
    Vec3 inward() const { return along.cross(down).normalized(); }
  };
  int texture(Surface surface);
  int plain_or(std::initializer_list<Surface> choices);
  bool is_clear(const Vec3& p, double radius) const;
  void add_panel(const Wall& wall, double from, double to, double low, double high, int texture, double texture_m, double offset,
                 float tint);
  void repeat_along(const Wall& wall);
  void add_door(const Wall& wall, double at);
  template <class Add>
  bool as_piece(const Add& add);
  bool add_shelf(const Wall& wall, double at);
  bool add_table(const Vec3& floor_point);
  bool add_box_stack(const Vec3& floor_point);
  bool add_tangle(const Vec3& floor_point);
  bool add_pillar(const Vec3& floor_point);
  void add_pipes(const Wall& wall);
  void add_window(const Wall& wall, double at);
  void lay_on_floor(const Vec3& centre, double angle, double length, double width, int texture, double texture_m, int layer);
  float tint() { return static_cast<float>(rng_.uniform(0.75, 1.2)); }

  World& world_;
  const WorldOptions& options_;
  const std::vector<Vec3>& path_;
  Rng rng_;
  std::vector<Wall> walls_;
};

/// Textures of each kind in the world's atlas: texture = surface * kVariants + variant.
inline constexpr int kVariants = 3;
void paint_all(World& world, std::uint64_t seed);

}  // namespace fbvins
