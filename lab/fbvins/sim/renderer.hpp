// SPDX-License-Identifier: Apache-2.0
// Renders the world through a camera with its real distortion, on the CPU. Every pixel's ray is cast
// exactly (no remapping of a pinhole image); tiles of 8 x 8 rays are intersected with the few facets that
// can be seen there, from near to far. One instant per call: motion blur is the sum of several.
// One Renderer per thread; the same input gives the same bits on every machine with the same libm.
//
//   Renderer renderer(camera, world);
//   renderer.begin();
//   for (const Instant& instant : exposure) renderer.add(instant, facets, light, weight);
//   renderer.radiance(image);   // row by row, irradiance times reflectance
#pragma once

#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/sim/lighting.hpp"
#include "fbvins/sim/world.hpp"

namespace fbvins {

namespace rays {
struct Hits;
}

/// A camera's motion at one instant of an exposure.
struct Instant {
  /// Where the camera is when the middle line of a row of tiles is read, and how it turns there.
  struct Strip {
    Quat q_WC;
    Vec3 p_WC, w_WC_C;
  };
  Quat q_WC = Quat::Identity();
  Vec3 p_WC = Vec3::Zero();
  Vec3 w_WC_C = Vec3::Zero();      ///< rad/s, for lines read one after the other
  Vec3 v_WC = Vec3::Zero();        ///< m/s, in W
  double line_s = 0;               ///< time from line to line; 0: all at once
  Vec2 shift_px = Vec2::Zero();    ///< offset of the ray within the pixel, for antialiasing
  std::vector<Strip> strips = {};  ///< of all rows of tiles; empty: from the first line on as fast as there
};

class Renderer {
 public:
  /// `part`: what is to be rendered of the image; null: all.
  Renderer(const Camera& camera, const World& world, const Mask* part = nullptr);

  void begin();
  void add(const Instant& instant, const std::vector<Facet>& facets, const MixedLight& light, float weight);
  void radiance(std::vector<float>& image) const;
  /// Distance along z of the last instant added, metres; 0 for background.
  void depth(std::vector<float>& image) const;

  static constexpr int kTile = 8;
  static constexpr int kRays = kTile * kTile;

 private:
  /// A facet seen from a camera: with d = (x, y, 1) in C, w = m.d is 1/z of the hit, (a.d)/w and (b.d)/w
  /// are its coordinates on the facet.
  struct View {
    float m[3], a[3], b[3];
    float nearest_w;
    float x0, y0, x1, y1;  ///< bounds on the plane z = 1
    int facet;
  };
  struct Tile {
    float x0, y0, x1, y1;  ///< of its rays on the plane z = 1, with a margin
    float dx[2], dy[2];    ///< d(x, y) / d(pixel)
    float occluder_w = 0;
    std::vector<int> views;
  };
  void make_rays(const Camera& camera, const Mask* part);
  void look(const Instant& instant, const std::vector<Facet>& facets);
  void distribute(int first_row, int last_row);
  void render_tile(int index, const Instant& instant, const std::vector<Facet>& facets, const MixedLight& light, float weight);
  void add_mirror_images(const Instant& instant, const Facet& facet, const float* x, const float* y, const rays::Hits& hits,
                         int id, float weight, float* sum) const;
  void untile(const std::vector<float>& tiled, std::vector<float>& image) const;

  const World& world_;
  int width_, height_, tiles_x_, tiles_y_;
  std::vector<float> ray_x_, ray_y_;  ///< tile by tile
  std::vector<Tile> tiles_;
  std::vector<float> row_y0_, row_y1_, column_x0_, column_x1_;
  std::vector<View> views_;
  std::vector<float> sum_, depth_;  ///< tile by tile
};

}  // namespace fbvins
