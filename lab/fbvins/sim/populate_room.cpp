// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/populate_room.hpp"

#include <algorithm>
#include <cmath>
#include <future>
#include <numbers>

namespace fbvins {
namespace {}  // namespace

void paint_all(World& world, std::uint64_t seed) {
  std::vector<std::future<Canvas>> canvases;  // each with its own random numbers: the result does not depend on the threads
  for (int surface = 0; surface < static_cast<int>(Surface::count); ++surface)
    for (int variant = 0; variant < kVariants; ++variant)
      canvases.push_back(std::async(std::launch::async, [=] {
        Rng rng(seed, 100 + static_cast<std::uint64_t>(surface * kVariants + variant));
        return paint(static_cast<Surface>(surface), rng);
      }));
  for (auto& canvas : canvases) world.atlas.add(canvas.get());
  Rng rng(seed, 99);
  Canvas grain;
  for (float& t : grain.texels) t = static_cast<float>(std::clamp(0.5 + 0.22 * rng.normal(), 0.0, 1.0));
  world.detail_texture = world.atlas.add(grain);
}

void add_box(std::vector<Facet>& facets, const BoxShape& shape, int texture, float tint, double texture_m) {
  const Mat3 R = shape.q.toRotationMatrix();
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const int a = (axis + 1) % 3, b = (axis + 2) % 3;
      // u x v points outwards on both sides: the edges are swapped on one. Side walls keep v upright.
      Vec3 u = 2 * shape.half[a] * R.col(a), v = 2 * shape.half[b] * R.col(b);
      Facet f;
      f.corner = shape.centre + (side ? 1.0 : -1.0) * shape.half[axis] * R.col(axis) - 0.5 * (u + v);
      if (!side) std::swap(u, v);
      if (std::abs(u.z()) > std::abs(v.z())) {  // turn by a quarter so that v is the upright edge, pointing down
        const Vec3 old_u = u;
        f.corner += u;
        u = v;
        v = -old_u;
      }
      f.u = u;
      f.v = v;
      f.texture = texture;
      f.tint = tint;
      f.repeat_u = static_cast<float>(std::min(3.0, u.norm() / texture_m));
      f.repeat_v = static_cast<float>(std::min(3.0, v.norm() / texture_m));
      facets.push_back(f);
    }
}

RoomPopulator::RoomPopulator(World& world, const WorldOptions& options, const std::vector<Vec3>& path, std::uint64_t seed)
    : world_(world), options_(options), path_(path), rng_(seed, 31) {
  for (const WallRun& run : wall_runs(world.plan)) {
    const Vec2 d = run.b - run.a;
    walls_.push_back({Vec3(run.a.x(), run.a.y(), world.plan.height_m), Vec3(d.x(), d.y(), 0), Vec3(0, 0, -world.plan.height_m)});
  }
}

int RoomPopulator::texture(Surface surface) {
  return static_cast<int>(surface) * kVariants + static_cast<int>(rng_.below(kVariants));
}

int RoomPopulator::plain_or(std::initializer_list<Surface> choices) {
  if (rng_.uniform() < options_.plain_share)
    return texture(rng_.uniform() < options_.weave_share ? Surface::weave : Surface::plaster);
  return texture(*(choices.begin() + rng_.below(static_cast<std::uint32_t>(choices.size()))));
}

bool RoomPopulator::is_clear(const Vec3& p, double radius) const {
  const double nearest = radius + options_.clearance_m;
  return std::none_of(path_.begin(), path_.end(), [&](const Vec3& q) { return (p - q).squaredNorm() < nearest * nearest; });
}

/// A rectangle on a wall: metres along it and above the floor.
void RoomPopulator::add_panel(const Wall& wall, double from, double to, double low, double high, int texture, double texture_m,
                              double offset, float tint) {
  const Vec3 x = wall.along.normalized();
  Facet f;
  f.corner = wall.corner + from * x + Vec3(0, 0, high - world_.plan.height_m) + offset * wall.inward();
  f.u = (to - from) * x;
  f.v = Vec3(0, 0, low - high);
  f.texture = texture;
  f.tint = tint;
  f.repeat_u = static_cast<float>((to - from) / texture_m);
  f.repeat_v = static_cast<float>((high - low) / texture_m);
  f.shift_u = texture_m < 10 && texture_m != to - from ? static_cast<float>(std::fmod(from / texture_m, 1.0)) : 0.0f;
  world_.facets.push_back(f);
}

void RoomPopulator::build_shell() {
  for (const Wall& wall : walls_) {
    const int base = plain_or({Surface::plaster, Surface::brick, Surface::concrete, Surface::concrete, Surface::wood});
    const float shade = tint();
    // In pieces, so that no facet spans near and far.
    const int pieces = std::max(1, static_cast<int>(wall.length() / 3.0));
    for (int i = 0; i < pieces; ++i)
      add_panel(wall, wall.length() * i / pieces, wall.length() * (i + 1) / pieces, 0, world_.plan.height_m, base, 1.9, 0, shade);
    add_panel(wall, 0, wall.length(), 0, 0.12, texture(Surface::wood), 1.3, 0.012, 0.7f);
  }
  const int floor = plain_or({Surface::wood, Surface::tiles, Surface::carpet, Surface::concrete});
  const int ceiling = plain_or({Surface::concrete, Surface::tiles, Surface::metal});
  for (const FloorRect& r : world_.plan.rooms) {
    const int nx = std::max(1, static_cast<int>((r.x1 - r.x0) / 3)), ny = std::max(1, static_cast<int>((r.y1 - r.y0) / 3));
    const Vec3 dx((r.x1 - r.x0) / nx, 0, 0), dy(0, (r.y1 - r.y0) / ny, 0);
    for (int i = 0; i < nx; ++i)
      for (int j = 0; j < ny; ++j) {
        Facet f;
        f.corner = Vec3(r.x0, r.y0, 0) + i * dx + j * dy;
        f.u = dx;
        f.v = dy;
        f.texture = floor;
        f.repeat_u = static_cast<float>(dx.x() / 1.7);
        f.repeat_v = static_cast<float>(dy.y() / 1.7);
        f.shift_u = static_cast<float>(f.corner.x() / 1.7 - std::floor(f.corner.x() / 1.7));
        f.shift_v = static_cast<float>(f.corner.y() / 1.7 - std::floor(f.corner.y() / 1.7));
        f.gloss = static_cast<float>(options_.gloss);
        world_.facets.push_back(f);
        f.corner.z() = world_.plan.height_m;
        std::swap(f.u, f.v);
        std::swap(f.repeat_u, f.repeat_v);
        std::swap(f.shift_u, f.shift_v);
        f.texture = ceiling;
        f.tint = 0.9f;
        f.gloss = 0;
        world_.facets.push_back(f);
      }
  }
}

/// Equal things at equal distances, such as lockers or posts: ambiguous for matchers.
void RoomPopulator::repeat_along(const Wall& wall) {
  const double pitch = rng_.uniform(0.5, 1.1), width = pitch * rng_.uniform(0.45, 0.8);
  const double low = rng_.uniform(0.2, 1.0), high = low + rng_.uniform(0.7, 1.4);
  const int what = plain_or({Surface::panel, Surface::metal, Surface::books, Surface::cardboard});
  const double from = rng_.uniform(0, 0.3) * wall.length(), to = wall.length() * rng_.uniform(0.6, 1.0);
  for (double at = from; at + width < to; at += pitch)
    add_panel(wall, at, at + width, low, std::min(high, world_.plan.height_m - 0.1), what, width, 0.02, 1);
}

void RoomPopulator::add_door(const Wall& wall, double at) {
  const double high = std::min(2.05, world_.plan.height_m - 0.1);
  add_panel(wall, at, at + 1.04, 0, high + 0.07, texture(Surface::metal), 1.04, 0.014, 0.6f);
  add_panel(wall, at + 0.07, at + 0.97, 0, high, texture(Surface::wood), 1.6, 0.02, 1.0f);
  add_panel(wall, at + 0.84, at + 0.93, 0.95, 1.15, texture(Surface::panel), 0.3, 0.05, 1.3f);
  if (rng_.uniform() < 0.6) add_panel(wall, at + 0.25, at + 0.75, 1.3, 1.65, texture(Surface::page), 0.5, 0.025, 1.0f);
}

/// A window with a grid of bars and bright sky, and a radiator below.
void RoomPopulator::add_window(const Wall& wall, double at) {
  const double width = rng_.uniform(0.8, 1.4), high = std::min(world_.plan.height_m - 0.25, 2.3);
  if (at + width + 0.1 > wall.length()) return;
  add_panel(wall, at - 0.06, at + width + 0.06, 0.9, high + 0.06, texture(Surface::wood), 1.0, 0.013, 1.2f);
  const int columns = 1 + static_cast<int>(rng_.below(2)), rows = 1 + static_cast<int>(rng_.below(2));
  const int glass = texture(Surface::plaster);
  for (int i = 0; i < columns; ++i)
    for (int j = 0; j < rows; ++j) {
      const double w = width / columns, h = (high - 0.9) / rows;
      add_panel(wall, at + i * w + 0.03, at + (i + 1) * w - 0.03, 0.9 + j * h + 0.03, 0.9 + (j + 1) * h - 0.03, glass, 2.0, 0.02,
                0.3f);
      world_.facets.back().emission = static_cast<float>(options_.window_glow);
      world_.facets.back().lamp_group = kAmbient;
    }
  for (double x = at; x + 0.05 < at + width; x += 0.065) add_panel(wall, x, x + 0.04, 0.15, 0.75, glass, 2.0, 0.06, 1.2f);
  add_panel(wall, at, at + width, 0.12, 0.78, texture(Surface::metal), 2.0, 0.03, 0.35f);
}

void RoomPopulator::lay_on_floor(const Vec3& centre, double angle, double length, double width, int texture, double texture_m,
                                 int layer) {
  const Vec3 x(std::cos(angle), std::sin(angle), 0), y(-x.y(), x.x(), 0);
  Facet f;
  f.u = length * x;
  f.v = width * y;
  f.corner = centre - 0.5 * (f.u + f.v) + Vec3(0, 0, 0.002 + 0.0006 * layer);
  f.texture = texture;
  f.tint = tint();
  f.repeat_u = static_cast<float>(length / texture_m);
  f.repeat_v = static_cast<float>(width / texture_m);
  f.shift_u = static_cast<float>(rng_.uniform());
  if (std::abs(f.repeat_u - 1) < 1e-3f) f.shift_u = 0;
  world_.facets.push_back(f);
}

void RoomPopulator::cover_floors() {
  for (const FloorRect& room : world_.plan.rooms) {
    const auto somewhere = [&] {
      const double x = rng_.uniform(room.x0 + 0.3, room.x1 - 0.3), y = rng_.uniform(room.y0 + 0.3, room.y1 - 0.3);
      return Vec3(x, y, 0);
    };
    const double amount = options_.floor_marks * room.area();
    int layer = 0;
    for (int i = 0; i < static_cast<int>(0.1 * amount); ++i) {
      const double size = rng_.uniform(0.8, 1.6), angle = rng_.uniform(0, std::numbers::pi);
      const int what = texture(rng_.uniform() < 0.75 ? Surface::mat : Surface::picture);
      lay_on_floor(somewhere(), angle, size, size, what, size, layer++);
    }
    for (int i = 0; i < static_cast<int>(0.1 * amount); ++i) {
      const double length = rng_.uniform(1.0, 3.0), angle = rng_.uniform(0, std::numbers::pi);
      const int what = texture(Surface::marks);
      lay_on_floor(somewhere(), angle, length, 0.13, what, 0.45, layer++);
    }
    for (int i = 0; i < static_cast<int>(0.5 * amount); ++i) {
      const double size = rng_.uniform(0.08, 0.3), angle = rng_.uniform(0, std::numbers::pi), shape = rng_.uniform(0.5, 1.0);
      const Surface kinds[] = {Surface::page, Surface::plaster, Surface::plaster, Surface::checker};
      const int what = texture(kinds[rng_.below(4)]);
      lay_on_floor(somewhere(), angle, size, size * shape, what, size, layer++);
    }
  }
}

void RoomPopulator::hang_pictures() {
  for (const Wall& wall : walls_) {
    if (wall.length() < 0.8) continue;
    if (rng_.uniform() < options_.repeat_share) repeat_along(wall);
    if (wall.length() > 3) add_door(wall, rng_.uniform(0.3, wall.length() - 1.4));
    for (double at = rng_.uniform(0.3, 2.5); at + 1 < wall.length(); at += rng_.uniform(1.8, 5.0))
      if (rng_.uniform() < options_.window_share) add_window(wall, at);
    if (rng_.uniform() < 0.7) add_pipes(wall);
    const int count = static_cast<int>(options_.posters_per_m2 * wall.length() * world_.plan.height_m + rng_.uniform());
    for (int i = 0; i < count; ++i) {
      const double width = rng_.uniform(0.2, 1.1), height = width * rng_.uniform(0.6, 1.45);
      if (width + 0.1 > wall.length() || height + 0.4 > world_.plan.height_m) continue;
      const double from = rng_.uniform(0, wall.length() - width), low = rng_.uniform(0.3, world_.plan.height_m - height - 0.05);
      const Surface kinds[] = {Surface::page,  Surface::poster, Surface::picture, Surface::picture,
                               Surface::panel, Surface::cloth,  Surface::mat,     Surface::checker};
      const int what = texture(kinds[rng_.below(8)]);
      // Each a little in front of the last, so that overlapping ones do not flicker.
      const double out = 0.022 + 0.0008 * i;
      add_panel(wall, from - 0.02, from + width + 0.02, low - 0.02, low + height + 0.02, texture(Surface::wood), 1.0,
                out - 0.0004, 0.5f);
      add_panel(wall, from, from + width, low, low + height, what, std::max(width, height), out, tint());
    }
  }
}

/// Notes the facets that `add` puts into the room as one piece. Returns what it returns.
template <class Add>
bool RoomPopulator::as_piece(const Add& add) {
  const std::size_t first = world_.facets.size();
  const bool done = add();
  if (world_.facets.size() > first) world_.furniture.push_back({first, world_.facets.size() - first});
  return done;
}

void RoomPopulator::place_furniture() {
  for (const Wall& wall : walls_)
    for (double at = rng_.uniform(0.1, 1.0); at + 0.6 < wall.length(); at += rng_.uniform(1.2, 3.0))
      if (rng_.uniform() < 0.2 * options_.clutter_per_m2 + 0.1) as_piece([&] { return add_shelf(wall, at); });
  for (const FloorRect& room : world_.plan.rooms) {
    if (options_.kind == "hall")
      for (double x = room.x0 + 1.2; x < room.x1 - 1; x += 2.4)
        for (double y = room.y0 + 1.0; y < room.y1; y += room.y1 - room.y0 - 2.0) add_pillar(Vec3(x, y, 0));
    const int count = static_cast<int>(options_.clutter_per_m2 * room.area());
    int placed = 0;
    for (int tries = 0; placed < count && tries < 8 * count; ++tries) {
      const double x = rng_.uniform(room.x0 + 0.35, room.x1 - 0.35), y = rng_.uniform(room.y0 + 0.35, room.y1 - 0.35);
      const bool table = rng_.uniform() < 0.22;
      placed += as_piece([&] { return table ? add_table(Vec3(x, y, 0)) : add_box_stack(Vec3(x, y, 0)); }) ? 1 : 0;
    }
    const int tangles = static_cast<int>(options_.tangles_per_m2 * room.area());
    for (int tries = 0, stand = 0; stand < tangles && tries < 8 * tangles; ++tries) {
      const double x = rng_.uniform(room.x0 + 0.3, room.x1 - 0.3), y = rng_.uniform(room.y0 + 0.3, room.y1 - 0.3);
      stand += as_piece([&] { return add_tangle(Vec3(x, y, 0)); }) ? 1 : 0;
    }
  }
}

void RoomPopulator::hang_lamps() {
  const double z = world_.plan.height_m;
  int number = 0;
  for (const FloorRect& r : world_.plan.rooms) {
    if (r.area() < 1.5) continue;  // a door
    const int nx = std::max(1, static_cast<int>(std::lround((r.x1 - r.x0) / options_.lamp_spacing_m)));
    const int ny = std::max(1, static_cast<int>(std::lround((r.y1 - r.y0) / options_.lamp_spacing_m)));
    for (int i = 0; i < nx; ++i)
      for (int j = 0; j < ny; ++j, ++number) {
        const Vec3 p(r.x0 + (i + 0.5) * (r.x1 - r.x0) / nx, r.y0 + (j + 0.5) * (r.y1 - r.y0) / ny, z - 0.08);
        const int group = number % 2 ? kLampsB : kLampsA;
        world_.lamps.push_back({p, 0.55 * z * z * rng_.uniform(0.6, 1.3), group});
        Facet f;
        f.corner = p + Vec3(-0.35, -0.12, 0);
        f.u = Vec3(0, 0.24, 0);
        f.v = Vec3(0.7, 0, 0);
        f.texture = texture(Surface::plaster);
        f.emission = static_cast<float>(options_.lamp_glow);
        f.lamp_group = group;
        world_.facets.push_back(f);
      }
  }
}

/// Half of them are people, made of boxes for legs, body, arms and head; the others are boxes.
void RoomPopulator::add_movers() {
  for (int i = 0; i < options_.movers; ++i) {
    const FloorRect& room = world_.plan.rooms[rng_.below(static_cast<std::uint32_t>(world_.plan.rooms.size()))];
    Mover mover;
    const auto somewhere = [&] {
      const double x = rng_.uniform(room.x0 + 0.5, room.x1 - 0.5), y = rng_.uniform(room.y0 + 0.5, room.y1 - 0.5);
      return Vec3(x, y, 0);
    };
    mover.from = somewhere();
    mover.to = somewhere();
    mover.round_trip_s = std::max(4.0, 2 * (mover.to - mover.from).norm() / rng_.uniform(0.4, 0.9));
    mover.phase_rad = rng_.uniform(0, 2 * std::numbers::pi);
    mover.spin_radps = rng_.uniform(-0.5, 0.5);
    if (i % 2 == 0) {
      const int coat = texture(Surface::cloth), trousers = texture(Surface::carpet), skin = texture(Surface::plaster);
      for (double side : {-1.0, 1.0}) {
        add_box(mover.facets, {Vec3(0, 0.11 * side, 0.42), Vec3(0.09, 0.08, 0.42)}, trousers, 0.8f, 0.6);
        add_box(mover.facets, {Vec3(0.02, 0.29 * side, 1.13), Vec3(0.06, 0.06, 0.32), so3_exp(Vec3(0.1 * side, 0.25 * side, 0))},
                coat, 0.9f, 0.6);
      }
      add_box(mover.facets, {Vec3(0, 0, 1.14), Vec3(0.13, 0.22, 0.31)}, coat, 1.0f, 0.6);
      add_box(mover.facets, {Vec3(0, 0, 1.6), Vec3(0.1, 0.08, 0.12)}, skin, 0.9f, 0.4);
      mover.radius_m = 0.45;
    } else {
      const double a = rng_.uniform(0.15, 0.4), b = rng_.uniform(0.15, 0.4), c = rng_.uniform(0.2, 0.6),
                   z = rng_.uniform(0.6, 1.6);
      const int what = plain_or({Surface::cardboard, Surface::poster, Surface::panel});
      add_box(mover.facets, {Vec3(0, 0, z), Vec3(a, b, c)}, what, 1.0f, 0.8);
      mover.radius_m = 0.6;
    }
    world_.movers.push_back(std::move(mover));
  }
}

}  // namespace fbvins
