// SPDX-License-Identifier: Apache-2.0
// Irradiance of the world: baked once for each group of lamps, with shadows, and mixed for every
// image by the lamps' state at that moment. The bake is immutable; mixing is a pure function of time.
//
//   LightBake bake = bake_light(world, options.ambient);
//   LightState lamps = light_at(light_options, world, t, seed);
//   mix_light(bake, world, facets, lamps, options.ambient, mixed);
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "fbvins/sim/world.hpp"

namespace fbvins {

/// A facet's grid of nodes, edges included.
struct LightGrid {
  int first = 0;  ///< index of its first node
  int nx = 2, ny = 2;
};

struct LightBake {
  std::vector<LightGrid> grids;                        ///< one for each static facet
  std::array<std::vector<float>, kLightGroups> nodes;  ///< irradiance by group
};

LightBake bake_light(const World& world, double ambient);

struct LightOptions {
  std::string change = "steady";
  double strength = 1.0;
  double level = 1.0;

  template <class V>
  void visit(V&& v) {
    v("change", change, "steady|flicker|switching|moving", "how the lamps change over time");
    v("strength", strength, "", "strength of that change", 0.0, 3.0);
    v("level", level, "", "brightness of all lamps; 1 is a well-lit room", 0.001, 100.0);
  }
};

/// The lamps at an instant.
struct LightState {
  std::array<double, kLightGroups> group{1, 1, 1};
  std::optional<Lamp> carried;  ///< a lamp that moves; casts no shadows
};
LightState light_at(const LightOptions& options, const World& world, double t_s, std::uint64_t seed);

/// Irradiance in the renderer's format: words of four neighbouring nodes in 8 bits each (see texture.hpp),
/// (nx - 1) x (ny - 1) cells for each facet.
struct MixedLight {
  struct Facet {
    int first = 0;  ///< index of its first word
    int cells_x = 1, cells_y = 1;
    float scale = 0;  ///< irradiance for byte 255
  };
  std::vector<Facet> facets;
  std::vector<std::uint32_t> words;
};

/// `facets`: the world's, then those of this instant's movers, which get one value each.
void mix_light(const LightBake& bake, const World& world, const std::vector<Facet>& facets, const LightState& lamps,
               double ambient, MixedLight& mixed);

}  // namespace fbvins
