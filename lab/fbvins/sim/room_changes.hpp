// SPDX-License-Identifier: Apache-2.0
// A room after some months: other lamps, furniture elsewhere. Walls, floor and what hangs or lies there stay. Pure functions of
// the generator.
//
//   World later = *world;
//   change_lamps(later, LampChange::standing, rng);
//   move_furniture(later, 0.3, path, rng);              // three of ten pieces, none of them into the path
#pragma once

#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/sim/world.hpp"

namespace fbvins {

enum class LampChange {
  none,
  half,      ///< every second ceiling lamp is off
  standing,  ///< the ceiling lamps are off; lamps stand and hang near the walls
  sun        ///< the ceiling lamps are off; one strong light comes from high up at a wall
};

void change_lamps(World& world, LampChange change, Rng& rng);

/// Turns that share of the pieces and puts them elsewhere. One for which there is no room off the path leaves the house.
void move_furniture(World& world, double share, const std::vector<Vec3>& path, Rng& rng);

/// Whether no surface is nearer than a camera needs, and it is inside the walls.
bool has_room_for_camera(const World& world, const Vec3& p);

}  // namespace fbvins
