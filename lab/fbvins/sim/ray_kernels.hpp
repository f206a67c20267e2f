// SPDX-License-Identifier: Apache-2.0
// The inner loops of the renderer, over the 64 rays of a tile. Plain loops over fixed lanes; no state.
#pragma once

#include <cstdint>

namespace fbvins::rays {

inline constexpr int kRays = 64;

/// Hits of 64 rays: inverse depth, numerators of the coordinates on the facet, and its id.
struct Hits {
  alignas(64) float w[kRays];
  alignas(64) float u[kRays];
  alignas(64) float v[kRays];
  alignas(64) int id[kRays];
};

/// Keeps, for each ray (x, y, 1), the nearer of the hit so far and this facet's.
void intersect(const float* x, const float* y, const float* m, const float* a, const float* b, int id, Hits& hits);

/// The rays of a tile, moved by (dx, dy) on the plane z = 1.
void shift(const float* ray_x, const float* ray_y, float dx, float dy, float* x, float* y);

/// u and v become coordinates in [0, 1]; the depth of each ray, 0 where it hit nothing.
void divide(Hits& hits, float* depth);

/// Adds a highlight in the direction `towards` (a unit vector) to the rays (x, y, 1) that hit `id`.
void add_spot(const float* x, const float* y, const Hits& hits, int id, const float* towards, float strength, float* sum);

/// Appearance of one facet.
struct Look {
  const std::uint32_t* texture;
  const std::uint32_t* detail;
  const std::uint32_t* light;
  float repeat_u, repeat_v, shift_u, shift_v;
  float lod_constant;  ///< level of detail at w = 1
  float detail_repeat, detail_lod, detail_strength;
  float light_x, light_y;  ///< cells
  float brightness;        ///< of a white texel where the light's byte is 255
  float emission;
};

/// The rays that hit `id`, packed to save look-ups. `ray`: their indices; unused if all rays hit it.
struct Lanes {
  alignas(64) float w[kRays];
  alignas(64) float u[kRays];
  alignas(64) float v[kRays];
  int ray[kRays];
  int count = 0;
};
void select(const Hits& hits, int id, Lanes& lanes);

/// Adds weight times the radiance of those rays.
void shade(const Lanes& lanes, const Look& look, float weight, float* sum);

}  // namespace fbvins::rays
