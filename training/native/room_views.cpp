// SPDX-License-Identifier: Apache-2.0
#include "training/native/room_views.hpp"

#include <array>
#include <cmath>
#include <optional>

#include "fbvins/sim/still_room.hpp"

namespace fbvins {
namespace {

constexpr std::array kPresets = {"normal", "tour",         "hall", "normal", "switching", "weak-texture", "fast",  "dim",
                                 "normal", "moving-light", "tour", "hall",   "handheld",  "glare",        "normal"};

SimulationOptions options_of(int seed, int frames) {
  SimulationOptions o = *simulation_preset(kPresets[static_cast<std::size_t>(seed) % kPresets.size()]);
  o.seed = seed;
  o.image_rate_hz = 1;
  o.flight.duration_s = frames + 2;
  o.camera.time_samples = std::min(o.camera.time_samples, 4);
  return o;
}

/// Their light comes from the change.
constexpr std::array kStillPresets = {"normal", "hall", "normal", "weak-texture"};
constexpr double kEvery_s = 2;
constexpr int kChanges = 5;

SimulationOptions still_options(int seed) {
  SimulationOptions o = *simulation_preset(kStillPresets[static_cast<std::size_t>(seed) % kStillPresets.size()]);
  o.seed = seed;
  o.camera.time_samples = 2;
  return o;
}

/// The first is none.
RoomChange random_change(int number, Rng& rng) {
  RoomChange change{.seed = number};
  if (number == 0) return change;
  constexpr std::array kLamps = {LampChange::none, LampChange::half, LampChange::standing, LampChange::sun};
  change.lamps = kLamps[rng.below(kLamps.size())];
  if (rng.uniform() < 0.6) change.moved_share = rng.uniform(0.1, 0.7);
  if (rng.uniform() < 0.4) change.level = std::exp(rng.uniform(std::log(0.03), std::log(0.5)));
  if (rng.uniform() < 0.6) change.exposure = rng.uniform(0.3, 1.7);
  return change;
}

/// Half of the views are nearly the same as before.
ViewChange random_view(Rng& rng) {
  const double strength = rng.uniform() < 0.5 ? 0.15 : 1;
  return {strength * rng.uniform(-65, 65), strength * rng.uniform(-1, 1)};
}

}  // namespace

void RoomViews::add(const RenderedFrame& rendered, const Pose<W, B>& T_WB) {
  frames_.push_back({*rendered.frame.left(), rendered.depth_left_m, T_WB * rig_.T_BC0()});
}

Result<RoomViews> RoomViews::render_changed(int seed) {
  const Result<StillRoom> still = StillRoom::build(still_options(seed), kEvery_s);
  if (!still) return still.error();
  RoomViews room;
  room.rig_ = still->rig();
  Rng rng(static_cast<std::uint64_t>(seed), 7);
  for (int number = 0; number <= kChanges; ++number) {
    std::vector<Pose<W, B>> poses;
    for (const Pose<W, B>& view : still->views())
      if (const auto pose = number == 0 ? std::optional(view) : still->seen_from(view, random_view(rng))) poses.push_back(*pose);
    const std::vector<RenderedFrame> rendered = still->render(poses, random_change(number, rng), true);
    for (std::size_t i = 0; i < poses.size(); ++i) room.add(rendered[i], poses[i]);
  }
  return room;
}

Result<RoomViews> RoomViews::render(int seed, int frames) {
  Result<Simulation> simulation = prepare_simulation(options_of(seed, frames));
  if (!simulation) return simulation.error();
  RoomViews room;
  room.rig_ = simulation->rig;
  for (std::size_t i = 0; i < simulation->frames.size() && i < static_cast<std::size_t>(frames); ++i) {
    room.add(render_frame(*simulation, i, true), simulation->flight.pose((simulation->frames[i] - simulation->start).seconds()));
  }
  return room;
}

float RoomViews::depth_at(const Frame& frame, const Vec2& px) const {
  const auto x = static_cast<std::size_t>(std::lround(px.x())), y = static_cast<std::size_t>(std::lround(px.y()));
  return frame.depth_m[y * static_cast<std::size_t>(frame.image.width()) + x];
}

std::optional<Vec2> RoomViews::transfer(std::size_t from, std::size_t to, const Vec2& px) const {
  constexpr double kSameSurface = 0.03;  // of the depth; a point farther off is occluded
  const Frame &a = frames_[from], &b = frames_[to];
  const float z = depth_at(a, px);
  const std::optional<Vec2> ray = rig_.left().undistort(px);
  if (!(z > 0) || !ray) return std::nullopt;
  const Vec3 p_C = b.T_WC.inverse() * (a.T_WC * Vec3(z * ray->homogeneous()));
  if (p_C.z() < 0.1) return std::nullopt;
  const std::optional<Vec2> there = rig_.left().project(p_C);
  if (!there || !rig_.left().inside(*there, 2)) return std::nullopt;
  if (std::abs(depth_at(b, *there) - p_C.z()) > kSameSurface * p_C.z() + 0.01) return std::nullopt;
  return there;
}

double RoomViews::overlap(std::size_t from, std::size_t to) const {
  constexpr int kStep = 32;
  int seen = 0, all = 0;
  for (int y = kStep / 2; y < rig_.left().height(); y += kStep)
    for (int x = kStep / 2; x < rig_.left().width(); x += kStep, ++all) seen += transfer(from, to, Vec2(x, y)) ? 1 : 0;
  return static_cast<double>(seen) / all;
}

std::optional<RoomViews::Pair> RoomViews::choose(Rng& rng) const {
  for (int attempt = 0; attempt < 200; ++attempt) {
    const auto from = static_cast<std::size_t>(rng.uniform() * static_cast<double>(frames_.size()));
    const auto to = static_cast<std::size_t>(rng.uniform() * static_cast<double>(frames_.size()));
    if (from == to) continue;
    const double shared = overlap(from, to);
    if (shared > 0.15 && shared < 0.95) return Pair{from, to};
  }
  return std::nullopt;
}

}  // namespace fbvins
