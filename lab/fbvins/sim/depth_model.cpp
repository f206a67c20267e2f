// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/depth_model.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace {

/// Values at the corners of square patches, one of each kind for a patch.
struct Patch {
  float noise;   ///< normal, interpolated between patches
  float dx, dy;  ///< of -1 to 1: where an edge is taken from
  bool hole;
};

/// Rows of a depth image are seen by the second eye from the right to the left: what lies behind something nearer is hidden.
void cast_shadows(std::vector<float>& row_rho, double focal_px, double baseline_m) {
  double leftmost = 1e9;
  for (auto x = std::ssize(row_rho) - 1; x >= 0; --x) {
    float& rho = row_rho[static_cast<std::size_t>(x)];
    const double seen_at = static_cast<double>(x) - focal_px * baseline_m * rho;
    if (seen_at > leftmost + 1) rho = 0;
    leftmost = std::min(leftmost, seen_at);
  }
}

}  // namespace

DepthModel::DepthModel(const DepthModelOptions& options, const Camera& camera, std::uint64_t seed)
    : options_(options), width_(camera.width()), height_(camera.height()), focal_px_(camera.focal_px()), seed_(seed) {}

DepthImage DepthModel::measure(const std::vector<float>& exact_m, std::int64_t frame) const {
  Rng rng(seed_, 7000 + static_cast<std::uint64_t>(frame));
  const double side_px = options_.window_px;
  const int across = static_cast<int>(width_ / side_px) + 2, down = static_cast<int>(height_ / side_px) + 2;
  std::vector<Patch> patches(static_cast<std::size_t>(across * down));
  for (Patch& p : patches) {
    p.noise = static_cast<float>(rng.normal());
    p.dx = static_cast<float>(2 * rng.uniform() - 1);
    p.dy = static_cast<float>(2 * rng.uniform() - 1);
    p.hole = rng.uniform() < options_.hole_share;
  }
  const auto patch = [&](int x, int y) -> const Patch& { return patches[static_cast<std::size_t>(y * across + x)]; };
  const auto depth = [&](double x, double y) {
    const int u = std::clamp(static_cast<int>(std::lround(x)), 0, width_ - 1),
              v = std::clamp(static_cast<int>(std::lround(y)), 0, height_ - 1);
    return exact_m[static_cast<std::size_t>(v * width_ + u)];
  };

  DepthImage out{width_, height_, {}};
  out.mm.reserve(exact_m.size());
  std::vector<float> row(static_cast<std::size_t>(width_));
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const float here = depth(x, y);
      row[static_cast<std::size_t>(x)] = here > 0 ? 1 / here : 0;
    }
    cast_shadows(row, focal_px_, options_.baseline_m);
    for (int x = 0; x < width_; ++x) {
      const double px = x / side_px, py = y / side_px;
      const int ix = static_cast<int>(px), iy = static_cast<int>(py);
      const Patch& own = patch(ix, iy);
      const float beside = depth(x + options_.edge_px * own.dx, y + options_.edge_px * own.dy);
      float rho = row[static_cast<std::size_t>(x)];
      if (rho > 0 && beside > 0) rho = std::max(rho, 1 / beside);
      // Between four normal values, so that the variance is one everywhere.
      const double u = px - ix, v = py - iy;
      const double weights[] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
      const double sum = weights[0] * own.noise + weights[1] * patch(ix + 1, iy).noise + weights[2] * patch(ix, iy + 1).noise +
                         weights[3] * patch(ix + 1, iy + 1).noise;
      double squares = 0;
      for (const double w : weights) squares += w * w;
      const double noisy = rho + options_.noise_at_1m_m * sum / std::sqrt(squares);
      const double z = noisy > 0 ? 1 / noisy : 0;
      const bool measured = rho > 0 && !own.hole && z >= options_.nearest_m && z <= options_.farthest_m;
      out.mm.push_back(measured ? static_cast<std::uint16_t>(std::lround(1000 * z)) : 0);
    }
  }
  return out;
}

}  // namespace fbvins
