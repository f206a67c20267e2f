// SPDX-License-Identifier: Apache-2.0
// Light that falls on the world: baked once for each group of lamps, with shadows, and mixed for every
// image by what the lamps do at that moment. The bake is immutable; mixing is a pure function of time.
//
//   LightBake bake = bake_light(world, options.ambient);
//   LightState lamps = light_at(light_options, world, t, seed);
//   mix_light(bake, world, lamps, mixed);
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "fbvins/sim/world.hpp"

namespace fbvins {

/// Numbers at nodes of a grid over each facet, edges included.
struct LightGrid {
  int first = 0;  ///< node
  int nx = 2, ny = 2;
};

struct LightBake {
  std::vector<LightGrid> grids;                        ///< one a static facet
  std::array<std::vector<float>, kLightGroups> nodes;  ///< irradiance by group
};

LightBake bake_light(const World& world, double ambient);

struct LightOptions {
  std::string change = "steady";
  double strength = 1.0;
  double level = 1.0;

  template <class V>
  void visit(V&& v) {
    v("change", change, "steady|flicker|switching|moving", "what the lamps do over time");
    v("strength", strength, "", "how strong that is", 0.0, 3.0);
    v("level", level, "", "brightness of all lamps; 1 is a well-lit room", 0.001, 100.0);
  }
};

/// What the lamps do at an instant.
struct LightState {
  std::array<double, kLightGroups> group{1, 1, 1};
  std::optional<Lamp> carried;  ///< a lamp that moves; casts no shadows
};
LightState light_at(const LightOptions& options, const World& world, double t_s, std::uint64_t seed);

/// The mixture as the renderer wants it: words of four neighbouring nodes in 8 bits (see texture.hpp),
/// one row of (nx - 1) x (ny - 1) cells a facet.
struct MixedLight {
  struct Facet {
    int first = 0;  ///< word
    int cells_x = 1, cells_y = 1;
    float scale = 0;  ///< irradiance of 255
  };
  std::vector<Facet> facets;
  std::vector<std::uint32_t> words;
};

/// `facets`: the world's, then this instant's movers, which get one value a side.
void mix_light(const LightBake& bake, const World& world, const std::vector<Facet>& facets, const LightState& lamps,
               double ambient, MixedLight& mixed);

}  // namespace fbvins
