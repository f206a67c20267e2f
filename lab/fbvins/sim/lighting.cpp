// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/lighting.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <thread>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace {

constexpr double kNode_m = 0.22;
constexpr double kReach_m = 9.0;      ///< lamps farther away are ignored
constexpr double kOcclusion_m = 0.9;  ///< things nearer than this occlude ambient light

/// A facet prepared for shadow rays, single precision.
struct Blocker {
  Eigen::Vector3f corner, n, a, b, centre;
  float radius;
};

std::vector<Blocker> blockers_of(const World& world) {
  std::vector<Blocker> blockers;
  for (const Facet& f : world.facets) {
    if (f.emission > 0) continue;  // lamps let their own light pass
    const Vec3 n = f.u.cross(f.v);
    const double nn = n.squaredNorm();
    blockers.push_back({f.corner.cast<float>(), n.cast<float>(), Vec3(f.v.cross(n) / nn).cast<float>(),
                        Vec3(n.cross(f.u) / nn).cast<float>(), f.centre().cast<float>(),
                        static_cast<float>(0.5 * (f.u + f.v).norm() > 0.5 * (f.u - f.v).norm() ? 0.5 * (f.u + f.v).norm()
                                                                                               : 0.5 * (f.u - f.v).norm())});
  }
  return blockers;
}

/// Whether anything is between x and x + d.
bool blocked(const std::vector<Blocker>& blockers, const Eigen::Vector3f& x, const Eigen::Vector3f& d) {
  for (const Blocker& k : blockers) {
    const float dn = d.dot(k.n);
    const float t = (k.corner - x).dot(k.n) / dn;
    if (!(t > 1e-3f && t < 0.999f)) continue;
    const Eigen::Vector3f h = x + t * d - k.corner;
    const float a = h.dot(k.a), b = h.dot(k.b);
    if (a >= 0 && a <= 1 && b >= 0 && b <= 1) return true;
  }
  return false;
}

double lamp_light(const Lamp& lamp, const Vec3& x, const Vec3& n) {
  const Vec3 d = lamp.p - x;
  const double r2 = d.squaredNorm();
  const double facing = n.dot(d);
  // 0.15 m^2 limits the light on the ceiling next to a lamp.
  return facing <= 0 ? 0.0 : lamp.power * facing / (std::sqrt(r2) * (r2 + 0.15));
}

Vec3 node_position(const Facet& f, int i, int j, const LightGrid& g) {
  // A little inside, so that edges shared with other surfaces do not shadow themselves.
  const double a = std::clamp(static_cast<double>(i) / (g.nx - 1), 0.01, 0.99),
               b = std::clamp(static_cast<double>(j) / (g.ny - 1), 0.01, 0.99);
  return f.corner + a * f.u + b * f.v + 0.006 * f.normal();
}

/// Ambient occlusion: share of directions in which nothing is near.
double openness(const std::vector<Blocker>& near, const Vec3& x, const Vec3& n) {
  const Vec3 s = (std::abs(n.z()) < 0.9 ? n.cross(Vec3::UnitZ()) : n.cross(Vec3::UnitX())).normalized(), t = n.cross(s);
  constexpr int kRays = 14;
  int open = 0;
  for (int k = 0; k < kRays; ++k) {  // a spiral with cosine-weighted density
    const double r = std::sqrt((k + 0.5) / kRays), angle = 2.399963 * k;
    const Vec3 d = r * std::cos(angle) * s + r * std::sin(angle) * t + std::sqrt(1 - r * r) * n;
    if (!blocked(near, x.cast<float>(), Vec3(kOcclusion_m * d).cast<float>())) ++open;
  }
  return static_cast<double>(open) / kRays;
}

/// Blockers that reach into a ball.
std::vector<Blocker> near_to(const std::vector<Blocker>& all, const Vec3& centre, double radius) {
  std::vector<Blocker> near;
  for (const Blocker& k : all)
    if ((k.centre - centre.cast<float>()).norm() < k.radius + static_cast<float>(radius)) near.push_back(k);
  return near;
}

/// Blockers that may stand between a ball and a point.
std::vector<Blocker> towards(const std::vector<Blocker>& all, const Vec3& centre, double radius, const Vec3& lamp) {
  std::vector<Blocker> between;
  const Vec3 d = lamp - centre;
  for (const Blocker& k : all) {
    const Vec3 c = k.centre.cast<double>() - centre;
    const double along = std::clamp(c.dot(d) / d.squaredNorm(), 0.0, 1.0);
    if ((c - along * d).norm() < k.radius + radius) between.push_back(k);
  }
  return between;
}

void bake_facet(const World& world, const std::vector<Blocker>& blockers, double ambient, std::size_t index, LightBake& bake) {
  const Facet& f = world.facets[index];
  const LightGrid& g = bake.grids[index];
  const double radius = 0.5 * std::max((f.u + f.v).norm(), (f.u - f.v).norm());
  const Vec3 n = f.normal();
  const auto for_nodes = [&](auto&& use) {
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) use(static_cast<std::size_t>(g.first + j * g.nx + i), node_position(f, i, j, g));
  };
  const std::vector<Blocker> near = near_to(blockers, f.centre(), radius + kOcclusion_m);
  for_nodes([&](std::size_t node, const Vec3& x) {
    bake.nodes[kAmbient][node] = static_cast<float>(ambient * (0.15 + 0.85 * openness(near, x, n)));
  });
  for (const Lamp& lamp : world.lamps) {
    if ((lamp.p - f.centre()).norm() > kReach_m + radius || n.dot(lamp.p - f.corner) < 1e-3) continue;
    const std::vector<Blocker> between = towards(blockers, f.centre(), radius, lamp.p);
    for_nodes([&](std::size_t node, const Vec3& x) {
      const double light = lamp_light(lamp, x, n);
      if (light > 2e-3 && !blocked(between, x.cast<float>(), Vec3(lamp.p - x).cast<float>()))
        bake.nodes[static_cast<std::size_t>(lamp.group)][node] += static_cast<float>((1 - ambient) * light);
    });
  }
}

int nodes_over(double length) { return std::clamp(static_cast<int>(std::lround(length / kNode_m)) + 1, 2, 25); }

/// A random value in 0..1 that depends on the step alone.
double hashed(std::uint64_t seed, std::int64_t step) {
  return Rng(seed * 1000003u + static_cast<std::uint64_t>(step), 41).uniform();
}

}  // namespace

LightBake bake_light(const World& world, double ambient) {
  LightBake bake;
  int nodes = 0;
  for (const Facet& f : world.facets) {
    const LightGrid grid{nodes, nodes_over(f.u.norm()), nodes_over(f.v.norm())};
    bake.grids.push_back(grid);
    nodes += grid.nx * grid.ny;
  }
  for (auto& group : bake.nodes) group.assign(static_cast<std::size_t>(nodes), 0.0f);
  const std::vector<Blocker> blockers = blockers_of(world);
  std::vector<std::thread> workers;  // facets are independent: the result does not depend on the threads
  const std::size_t count = std::max(1u, std::min(16u, std::thread::hardware_concurrency()));
  for (std::size_t w = 0; w < count; ++w)
    workers.emplace_back([&, w] {
      for (std::size_t i = w; i < world.facets.size(); i += count) bake_facet(world, blockers, ambient, i, bake);
    });
  for (std::thread& worker : workers) worker.join();
  return bake;
}

LightState light_at(const LightOptions& options, const World& world, double t_s, std::uint64_t seed) {
  LightState state;
  const double k = options.strength;
  if (options.change == "flicker") {
    const auto burst = static_cast<std::int64_t>(std::floor(t_s * 12));  // a failing fluorescent tube
    const double drop = hashed(seed, burst) < 0.3 ? 0.6 : 0.0;
    state.group[kLampsA] = std::max(0.05, 1 - k * (drop + 0.15 * std::sin(2 * std::numbers::pi * 3.1 * t_s)));
    state.group[kLampsB] = std::max(
        0.05, 1 + k * (0.3 * std::sin(2 * std::numbers::pi * 0.7 * t_s) + 0.12 * std::sin(2 * std::numbers::pi * 7.3 * t_s)));
    state.group[kAmbient] = 0.6 + 0.2 * (state.group[kLampsA] + state.group[kLampsB]);
  } else if (options.change == "switching") {
    const auto phase = static_cast<std::int64_t>(std::floor(t_s / 3.5));
    const bool a = phase % 2 == 0 || hashed(seed, phase) < 0.2, b = phase % 3 != 1;
    state.group[kLampsA] = a ? 1.0 : std::max(0.0, 1 - k);
    state.group[kLampsB] = b ? 1.0 : std::max(0.0, 1 - k);
    state.group[kAmbient] = 0.3 + 0.35 * (state.group[kLampsA] + state.group[kLampsB]);
  } else if (options.change == "moving") {
    state.group = {0.35, 0.35, 0.5};
    const FloorRect& r = world.plan.rooms.front();
    const double angle = 0.6 * t_s + 6.28 * hashed(seed, 0);
    state.carried = Lamp{Vec3(0.5 * (r.x0 + r.x1) + 0.33 * (r.x1 - r.x0) * std::cos(angle),
                              0.5 * (r.y0 + r.y1) + 0.33 * (r.y1 - r.y0) * std::sin(angle), 1.9),
                         3.0 * k * options.level, kLampsA};
  }
  for (double& g : state.group) g *= options.level;
  return state;
}

namespace {

void pack(const std::vector<float>& light, const LightGrid& g, MixedLight::Facet& out, std::vector<std::uint32_t>& words) {
  float largest = 1e-6f;
  for (float v : light) largest = std::max(largest, v);
  const auto byte = [&](int i, int j) {
    return static_cast<std::uint32_t>(light[static_cast<std::size_t>(j * g.nx + i)] / largest * 255.0f + 0.5f);
  };
  out.first = static_cast<int>(words.size());
  out.cells_x = g.nx - 1;
  out.cells_y = g.ny - 1;
  out.scale = largest;
  for (int j = 0; j + 1 < g.ny; ++j)
    for (int i = 0; i + 1 < g.nx; ++i)
      words.push_back(byte(i, j) | byte(i + 1, j) << 8 | byte(i, j + 1) << 16 | byte(i + 1, j + 1) << 24);
}

float light_on_mover(const World& world, const Facet& f, const LightState& lamps, double ambient) {
  double light = lamps.group[kAmbient] * ambient * 0.8;
  for (const Lamp& lamp : world.lamps)
    light += (1 - ambient) * lamps.group[static_cast<std::size_t>(lamp.group)] * lamp_light(lamp, f.centre(), f.normal());
  if (lamps.carried) light += lamp_light(*lamps.carried, f.centre(), f.normal());
  return static_cast<float>(light);
}

}  // namespace

void mix_light(const LightBake& bake, const World& world, const std::vector<Facet>& facets, const LightState& lamps,
               double ambient, MixedLight& mixed) {
  mixed.facets.assign(facets.size(), {});
  mixed.words.clear();
  std::vector<float> light;
  for (std::size_t k = 0; k < facets.size(); ++k) {
    LightGrid g;
    if (k >= bake.grids.size()) {
      light.assign(4, light_on_mover(world, facets[k], lamps, ambient));
    } else {
      g = bake.grids[k];
      light.assign(static_cast<std::size_t>(g.nx * g.ny), 0.0f);
      for (int group = 0; group < kLightGroups; ++group) {
        const float strength = static_cast<float>(lamps.group[static_cast<std::size_t>(group)]);
        const float* nodes = bake.nodes[static_cast<std::size_t>(group)].data() + g.first;
        for (std::size_t i = 0; i < light.size(); ++i) light[i] += strength * nodes[i];
      }
      if (lamps.carried) {
        const Vec3 n = facets[k].normal();
        for (int j = 0; j < g.ny; ++j)
          for (int i = 0; i < g.nx; ++i)
            light[static_cast<std::size_t>(j * g.nx + i)] +=
                static_cast<float>(lamp_light(*lamps.carried, node_position(facets[k], i, j, g), n));
      }
    }
    pack(light, g, mixed.facets[k], mixed.words);
  }
}

}  // namespace fbvins
