// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/renderer.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/sim/ray_kernels.hpp"

namespace fbvins {
namespace {

constexpr float kFarthest_w = 1e-3f;  ///< nothing beyond a kilometre
constexpr double kNear_m = 0.02;
/// Levels by which textures are sharper than for one ray per pixel, as a pixel has several rays.
constexpr float kSharper = 0.7f;
constexpr double kGrainRepeat = 7.0;  ///< copies of the grain in one copy of a texture

float largest_over(const float* f, float x0, float y0, float x1, float y1) {
  return f[2] + (f[0] > 0 ? f[0] * x1 : f[0] * x0) + (f[1] > 0 ? f[1] * y1 : f[1] * y0);
}
float smallest_over(const float* f, float x0, float y0, float x1, float y1) {
  return f[2] + (f[0] > 0 ? f[0] * x0 : f[0] * x1) + (f[1] > 0 ? f[1] * y0 : f[1] * y1);
}

/// Bounds on the plane z = 1 of what lies in front of the near plane; false if nothing does.
bool project_bounds(const Vec3 (&corners)[4], float& x0, float& y0, float& x1, float& y1) {
  x0 = y0 = 1e9f;
  x1 = y1 = -1e9f;
  const auto take = [&](const Vec3& p) {
    const float x = static_cast<float>(p.x() / p.z()), y = static_cast<float>(p.y() / p.z());
    x0 = std::min(x0, x);
    x1 = std::max(x1, x);
    y0 = std::min(y0, y);
    y1 = std::max(y1, y);
  };
  for (int i = 0; i < 4; ++i) {
    const Vec3 &p = corners[i], &q = corners[(i + 1) % 4];
    if (p.z() >= kNear_m) take(p);
    if ((p.z() >= kNear_m) != (q.z() >= kNear_m)) take(p + (q - p) * ((kNear_m - p.z()) / (q.z() - p.z())));
  }
  return x1 >= x0;
}

void store(float* out, const Vec3& v) {
  for (int i = 0; i < 3; ++i) out[i] = static_cast<float>(v[i]);
}

}  // namespace

Renderer::Renderer(const Camera& camera, const World& world, const Mask* part)
    : world_(world),
      width_(camera.width()),
      height_(camera.height()),
      tiles_x_((width_ + kTile - 1) / kTile),
      tiles_y_((height_ + kTile - 1) / kTile) {
  make_rays(camera, part);
}

void Renderer::make_rays(const Camera& camera, const Mask* part) {
  const std::size_t count = static_cast<std::size_t>(tiles_x_) * tiles_y_;
  ray_x_.assign(count * kRays, 0);
  ray_y_.assign(count * kRays, 0);
  sum_.assign(count * kRays, 0);
  depth_.assign(count * kRays, 0);
  tiles_.resize(count);
  row_y0_.assign(static_cast<std::size_t>(tiles_y_), 1e9f);
  row_y1_.assign(static_cast<std::size_t>(tiles_y_), -1e9f);
  column_x0_.assign(static_cast<std::size_t>(tiles_x_), 1e9f);
  column_x1_.assign(static_cast<std::size_t>(tiles_x_), -1e9f);
  const auto ray = [&](double x, double y) { return camera.undistort(Vec2(x, y)).value_or(Vec2::Zero()); };
  for (int ty = 0; ty < tiles_y_; ++ty)
    for (int tx = 0; tx < tiles_x_; ++tx) {
      const std::size_t index = static_cast<std::size_t>(ty) * tiles_x_ + tx;
      Tile& tile = tiles_[index];
      float x0 = 1e9f, y0 = 1e9f, x1 = -1e9f, y1 = -1e9f;
      if (part != nullptr && part->hides_all(tx * kTile, ty * kTile, (tx + 1) * kTile, (ty + 1) * kTile)) {
        tile.x0 = x0, tile.x1 = x1, tile.y0 = y0, tile.y1 = y1;  // no facet is in it
        continue;
      }
      for (int k = 0; k < kRays; ++k) {
        const int px = std::min(width_ - 1, tx * kTile + k % kTile), py = std::min(height_ - 1, ty * kTile + k / kTile);
        const Vec2 n = ray(px, py);
        const float x = static_cast<float>(n.x()), y = static_cast<float>(n.y());
        ray_x_[index * kRays + k] = x;
        ray_y_[index * kRays + k] = y;
        x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
      }
      const Vec2 c(tx * kTile + 3.5, ty * kTile + 3.5), px = ray(c.x() + 1, c.y()) - ray(c.x(), c.y()),
                                                        py = ray(c.x(), c.y() + 1) - ray(c.x(), c.y());
      tile.dx[0] = static_cast<float>(px.x()), tile.dx[1] = static_cast<float>(py.x());
      tile.dy[0] = static_cast<float>(px.y()), tile.dy[1] = static_cast<float>(py.y());
      const float margin = 3.0f * static_cast<float>(std::max(px.norm(), py.norm()));  // shift within the pixel, lines in motion
      tile.x0 = x0 - margin, tile.x1 = x1 + margin, tile.y0 = y0 - margin, tile.y1 = y1 + margin;
      row_y0_[ty] = std::min(row_y0_[ty], tile.y0), row_y1_[ty] = std::max(row_y1_[ty], tile.y1);
      column_x0_[tx] = std::min(column_x0_[tx], tile.x0), column_x1_[tx] = std::max(column_x1_[tx], tile.x1);
    }
}

void Renderer::begin() { std::fill(sum_.begin(), sum_.end(), 0.0f); }

/// Fills views_ with the facets that face the camera and may be in the image, nearest first.
void Renderer::look(const Instant& instant, const std::vector<Facet>& facets) {
  views_.clear();
  const Mat3 R_CW = instant.q_WC.conjugate().toRotationMatrix();
  for (std::size_t i = 0; i < facets.size(); ++i) {
    const Facet& f = facets[i];
    const Vec3 n = f.u.cross(f.v), s = instant.p_WC - f.corner;
    const double c = n.dot(s), nn = n.squaredNorm();
    if (!(c > 1e-4 * std::sqrt(nn))) continue;  // seen from behind, or edge-on
    const Vec3 corner = -(R_CW * s), u = R_CW * f.u, v = R_CW * f.v;
    View view;
    if (!project_bounds({corner, Vec3(corner + u), Vec3(corner + u + v), Vec3(corner + v)}, view.x0, view.y0, view.x1, view.y1))
      continue;
    const Vec3 m = -n / c, dual_u = f.v.cross(n) / nn, dual_v = n.cross(f.u) / nn;
    store(view.m, R_CW * m);
    store(view.a, R_CW * Vec3(dual_u + dual_u.dot(s) * m));
    store(view.b, R_CW * Vec3(dual_v + dual_v.dot(s) * m));
    view.nearest_w = 0;
    for (const Vec3& p : {corner, Vec3(corner + u), Vec3(corner + u + v), Vec3(corner + v)})
      view.nearest_w =
          std::max(view.nearest_w, p.z() > kNear_m ? static_cast<float>(1 / p.z()) : static_cast<float>(1 / kNear_m));
    view.facet = static_cast<int>(i);
    views_.push_back(view);
  }
  std::stable_sort(views_.begin(), views_.end(), [](const View& p, const View& q) { return p.nearest_w > q.nearest_w; });
}

/// Gives each tile the views that may be visible in it. A view that covers the whole tile hides all behind it.
void Renderer::distribute(int first_row, int last_row) {
  for (int t = first_row * tiles_x_; t < last_row * tiles_x_; ++t) {
    tiles_[static_cast<std::size_t>(t)].views.clear();
    tiles_[static_cast<std::size_t>(t)].occluder_w = kFarthest_w;
  }
  for (std::size_t k = 0; k < views_.size(); ++k) {
    const View& view = views_[k];
    int cx0 = 0, cx1 = tiles_x_;
    while (cx0 < cx1 && column_x1_[static_cast<std::size_t>(cx0)] < view.x0) ++cx0;
    while (cx1 > cx0 && column_x0_[static_cast<std::size_t>(cx1 - 1)] > view.x1) --cx1;
    float ma[3], mb[3];
    for (int i = 0; i < 3; ++i) ma[i] = view.m[i] - view.a[i], mb[i] = view.m[i] - view.b[i];
    for (int ty = first_row; ty < last_row; ++ty) {
      if (row_y1_[static_cast<std::size_t>(ty)] < view.y0 || row_y0_[static_cast<std::size_t>(ty)] > view.y1) continue;
      for (int tx = cx0; tx < cx1; ++tx) {
        Tile& t = tiles_[static_cast<std::size_t>(ty) * tiles_x_ + tx];
        if (largest_over(view.m, t.x0, t.y0, t.x1, t.y1) < t.occluder_w) continue;
        bool outside = false, covers = true;
        for (const float* edge : {static_cast<const float*>(view.a), static_cast<const float*>(view.b),
                                  static_cast<const float*>(ma), static_cast<const float*>(mb)}) {
          outside = outside || largest_over(edge, t.x0, t.y0, t.x1, t.y1) < 0;
          covers = covers && smallest_over(edge, t.x0, t.y0, t.x1, t.y1) >= 0;
        }
        if (outside) continue;
        t.views.push_back(static_cast<int>(k));
        if (covers) t.occluder_w = std::max(t.occluder_w, smallest_over(view.m, t.x0, t.y0, t.x1, t.y1));
      }
    }
  }
}

void Renderer::add(const Instant& instant, const std::vector<Facet>& facets, const MixedLight& light, float weight) {
  if (instant.line_s == 0) {
    look(instant, facets);
    distribute(0, tiles_y_);
    for (int t = 0; t < tiles_x_ * tiles_y_; ++t) render_tile(t, instant, facets, light, weight);
    return;
  }
  for (int row = 0; row < tiles_y_; ++row) {  // each row of tiles with the camera's pose when its middle line is read
    Instant strip = instant;
    const double dt = (row * kTile + 3.5) * instant.line_s;
    strip.strips.clear();
    if (instant.strips.empty()) {
      strip.p_WC += dt * instant.v_WC;
      strip.q_WC = (instant.q_WC * so3_exp(dt * instant.w_WC_C)).normalized();
    } else {
      const Instant::Strip& at = instant.strips[static_cast<std::size_t>(row)];
      strip.q_WC = at.q_WC, strip.p_WC = at.p_WC, strip.w_WC_C = at.w_WC_C;
    }
    look(strip, facets);
    distribute(row, row + 1);
    for (int t = row * tiles_x_; t < (row + 1) * tiles_x_; ++t) render_tile(t, strip, facets, light, weight);
  }
}

void Renderer::render_tile(int index, const Instant& instant, const std::vector<Facet>& facets, const MixedLight& light,
                           float weight) {
  const Tile& tile = tiles_[static_cast<std::size_t>(index)];
  const std::size_t first = static_cast<std::size_t>(index) * kRays;
  alignas(64) float x[kRays], y[kRays];
  const float sx = static_cast<float>(instant.shift_px.x()), sy = static_cast<float>(instant.shift_px.y());
  const float step_x = tile.dx[0] * sx + tile.dx[1] * sy, step_y = tile.dy[0] * sx + tile.dy[1] * sy;
  rays::shift(&ray_x_[first], &ray_y_[first], step_x, step_y, x, y);
  if (instant.line_s != 0)
    for (int i = 0; i < kRays; ++i) {
      const Vec3 w = instant.w_WC_C * ((i / kTile - 3.5) * instant.line_s);
      const Vec3 d = Vec3(x[i], y[i], 1) + w.cross(Vec3(x[i], y[i], 1));
      x[i] = static_cast<float>(d.x() / d.z());
      y[i] = static_cast<float>(d.y() / d.z());
    }

  rays::Hits hits;
  for (int i = 0; i < kRays; ++i) hits.w[i] = kFarthest_w, hits.u[i] = hits.v[i] = 0, hits.id[i] = -1;
  for (int k : tile.views) {
    const View& view = views_[static_cast<std::size_t>(k)];
    rays::intersect(x, y, view.m, view.a, view.b, k, hits);
  }
  rays::divide(hits, &depth_[first]);

  float* sum = sum_.data() + first;
  rays::Lanes lanes;
  for (int k : tile.views) {
    rays::select(hits, k, lanes);
    if (lanes.count == 0) continue;
    const View& view = views_[static_cast<std::size_t>(k)];
    const Facet& f = facets[static_cast<std::size_t>(view.facet)];
    const MixedLight::Facet& lit = light.facets[static_cast<std::size_t>(view.facet)];
    Mat3 H;
    H << view.a[0], view.a[1], view.a[2], view.b[0], view.b[1], view.b[2], view.m[0], view.m[1], view.m[2];
    const double pixel_area = std::abs(tile.dx[0] * tile.dy[1] - tile.dx[1] * tile.dy[0]);
    const double texels = std::abs(H.determinant()) * f.repeat_u * f.repeat_v * kTextureSize * kTextureSize * pixel_area;
    rays::Look look;
    look.texture = world_.atlas.words(f.texture);
    look.detail = world_.atlas.words(world_.detail_texture);
    look.light = light.words.data() + lit.first;
    // u x v points at the viewer, so u runs to the left if v runs down: without this, textures would be mirrored.
    look.repeat_u = -f.repeat_u, look.shift_u = f.shift_u + f.repeat_u, look.repeat_v = f.repeat_v, look.shift_v = f.shift_v;
    look.lod_constant = 0.5f * std::log2(static_cast<float>(texels) + 1e-20f) - kSharper;
    look.detail_repeat = static_cast<float>(kGrainRepeat);
    look.detail_lod = std::log2(look.detail_repeat);
    look.detail_strength = f.detail;
    look.light_x = static_cast<float>(lit.cells_x), look.light_y = static_cast<float>(lit.cells_y);
    look.brightness = f.tint * lit.scale;
    look.emission = f.emission;
    rays::shade(lanes, look, weight, sum);
    if (f.gloss > 0) add_mirror_images(instant, f, x, y, hits, k, weight, sum);
  }
}

/// A glossy surface shows each lamp as a blurred spot around its mirror image.
void Renderer::add_mirror_images(const Instant& instant, const Facet& facet, const float* x, const float* y,
                                 const rays::Hits& hits, int id, float weight, float* sum) const {
  const Vec3 n = facet.normal();
  for (const Lamp& lamp : world_.lamps) {
    const double height = n.dot(lamp.p - facet.corner);
    if (height <= 0.05) continue;
    const Vec3 d = instant.q_WC.conjugate() * Vec3(lamp.p - 2 * height * n - instant.p_WC);
    const double r = d.norm();
    if (r > 9) continue;
    const Vec3 towards = d / r;
    float unit[3];
    store(unit, towards);
    rays::add_spot(x, y, hits, id, unit, weight * facet.gloss * static_cast<float>(lamp.power / (r * r)), sum);
  }
}

/// Rearranges the tiles' values into an image.
void Renderer::untile(const std::vector<float>& tiled, std::vector<float>& image) const {
  image.resize(static_cast<std::size_t>(width_) * height_);
  for (int y = 0; y < height_; ++y)
    for (int tx = 0; tx < tiles_x_; ++tx) {
      const float* in = tiled.data() + (static_cast<std::size_t>(y / kTile) * tiles_x_ + tx) * kRays + (y % kTile) * kTile;
      std::copy_n(in, std::min(kTile, width_ - tx * kTile), image.data() + static_cast<std::size_t>(y) * width_ + tx * kTile);
    }
}

void Renderer::radiance(std::vector<float>& image) const { untile(sum_, image); }

void Renderer::depth(std::vector<float>& image) const { untile(depth_, image); }

}  // namespace fbvins
