// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/still_room.hpp"

#include "fbvins/core/angle.hpp"
#include "fbvins/core/options.hpp"
#include "fbvins/sim/flight_recorder.hpp"

namespace fbvins {
namespace {

constexpr double kAhead_m = 2.5;        ///< of the point about which a view is turned
constexpr double kSunlitAmbient = 0.2;  ///< share of ambient light where the sun comes in
constexpr int kSeedStep = 7919;         ///< so that changes of neighbouring rooms share no seed
constexpr std::uint64_t kChangeStream = 71;

World changed(const World& world, const RoomChange& change, std::vector<Vec3> path, const std::vector<Pose<W, B>>& poses,
              std::uint64_t seed) {
  World later = world;
  Rng rng(seed, kChangeStream);
  for (const Pose<W, B>& pose : poses) path.push_back(pose.p);
  move_furniture(later, change.moved_share, path, rng);
  change_lamps(later, change.lamps, rng);
  return later;
}

}  // namespace

Result<StillRoom> StillRoom::build(const SimulationOptions& options, double every_s) {
  if (Result<void> valid = validate(options); !valid) return valid.error();
  if (options.world.kind == "corridors") return Error{ErrorCode::invalid_argument, "a still room is of the kind room or hall"};
  Result<StereoRig> rig = simulated_rig(options);
  if (!rig) return rig.error();
  StillRoom room;
  room.options_ = options;
  room.options_.camera.exposure_lag_frames = 0;  // still images have no neighbours in time
  room.rig_ = *rig;
  const auto seed = static_cast<std::uint64_t>(options.seed);
  const SplineTrajectory flight = make_flight(options.flight, body_in_vehicle(*rig, options.flight.camera_pitch_deg), {}, seed);
  for (double t = 0; t < flight.duration_s(); t += 0.1) room.path_.push_back(flight.pose(t).p);
  for (double t = options.flight.rest_s; t < flight.duration_s(); t += every_s) room.views_.push_back(flight.pose(t));
  const FloorPlan plan = room_around(room.path_, options.world.margin_m, options.world.height_m);
  room.world_ = std::make_shared<const World>(build_world(options.world, plan, room.path_, seed));
  return room;
}

std::optional<Pose<W, B>> StillRoom::seen_from(const Pose<W, B>& view, const ViewChange& change) const {
  const Vec3 eye = view * rig_.T_BC0().p, axis = view.q * (rig_.T_BC0().q * Vec3::UnitZ());
  const Vec3 about = eye + kAhead_m * Vec3(axis.x(), axis.y(), 0).normalized();
  const Quat turn = so3_exp(Vec3(0, 0, change.turned_deg * kDegree));
  const Pose<W, B> moved((turn * view.q).normalized(), Vec3(turn * (view.p - about) + about + Vec3(0, 0, change.higher_m)));
  if (!has_room_for_camera(*world_, moved * rig_.T_BC0().p)) return std::nullopt;
  return moved;
}

std::vector<RenderedFrame> StillRoom::render(const std::vector<Pose<W, B>>& poses, const RoomChange& change,
                                             bool with_depth) const {
  SimulationOptions options = options_;
  options.seed = (options_.seed + kSeedStep * (change.seed + 1)) % 2'000'000'000;
  options.light.level *= change.level;
  options.camera.target_level *= change.exposure;
  if (change.lamps == LampChange::sun) options.world.ambient = kSunlitAmbient;
  auto world = std::make_shared<const World>(changed(*world_, change, path_, poses, static_cast<std::uint64_t>(options.seed)));
  MotionState still;
  FlightRecorder recorder(
      options, rig_, [&still](double) { return still; }, Vec3::Zero(), std::move(world));
  std::vector<RenderedFrame> frames;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    still.T_WB = poses[i];
    frames.push_back(recorder.render(0, static_cast<std::int64_t>(i), with_depth));
  }
  return frames;
}

}  // namespace fbvins
