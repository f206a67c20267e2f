// SPDX-License-Identifier: Apache-2.0
// Hours of flight in one process, through the whole odometry with a map: memory, time and accuracy must be as in the first hour.
//
//   endurance tracks --hours 24      simulated tracks and places of a lap that is flown again and again
//   endurance rest --hours 1         the same of a vehicle that stands
//   endurance images --hours 2       rendered images of a lap, klt
//
// A row for each interval. The time is the processor's, of odometry and map alone, without that of the simulation.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "bench/endless_flight.hpp"
#include "bench/endurance_rows.hpp"
#include "bench/synthetic_tracks.hpp"
#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/loop_map.hpp"
#include "fbvins/pipeline/system.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins::bench {
namespace {

constexpr double kLap_s = 120, kImagesLap_s = 20;
constexpr Time kStart{1'700'000'000'000'000'000};
// Growth from the interval after the first quarter to the last one that is not "flat"; errors below the floors are.
constexpr double kMemoryGrowth_mb = 5, kTimeGrowth = 1.25, kErrorGrowth = 1.5, kErrorFloor_m = 0.02, kDriftFloor_m = 0.005;

class TracksFrontend final : public Frontend {
 public:
  TracksFrontend(const Simulation& flight, const TrackOptions& options) : tracks_(flight, options) {}
  TrackedFrame process(const SensorPacket& packet, const StatePrior& prior) override {
    const Simulating simulating;
    return tracks_.frame_at(packet.id, packet.frame.t, prior);
  }
  void locate(const LandmarkUpdate& update) override {
    const Simulating simulating;
    tracks_.locate(update);
  }

 private:
  SyntheticTracks tracks_;
};

/// Loop closure with the features that a room of points would show.
class RoomMapper final : public Mapper {
 public:
  RoomMapper(const EndlessFlight& flight, const LoopOptions& options)
      : flight_(flight), closer_(test_room::rig(), options, test_room::vocabulary()) {}
  MapUpdate process(const Keyframe& keyframe) override {
    Place place = [&] {
      const Simulating simulating;
      return test_room::seen(room_, flight_.pose(keyframe.t).cast_frames<G, B>(), rng_);
    }();
    return closer_.process(std::move(place), keyframe);
  }

 private:
  const EndlessFlight& flight_;
  LoopCloser closer_;
  test_room::World room_ = test_room::room(1);
  Rng rng_{3};
};

struct Wanted {
  std::string part = "tracks";
  double hours = 1, interval_hours = 0;
  int max_keyframes = 200;
};

/// What a part flies with.
struct Setup {
  StereoRig rig;
  LapOptions lap;
  SystemOptions system;
  std::unique_ptr<Frontend> frontend;  ///< none: that of the options
  std::vector<StereoFrame> images;     ///< of a lap; one: always the same
  std::unique_ptr<Mapper> mapper;
};

/// Flies it, and prints a row for each interval. Returns whether the rows are flat.
bool fly(const Wanted& wanted, Setup& setup, EndlessFlight& flight) {
  System system = *System::create(setup.system, setup.rig, RunMode::deterministic,
                                  {.frontend = std::move(setup.frontend), .mapper = setup.mapper.get()});
  Interval interval;
  std::optional<Pose<M, W>> T_MW;
  int map_keyframes = 0;
  system.on_map_update([&](const MapUpdate& u) {
    T_MW = u.localised ? std::optional(u.T_MW) : std::nullopt;
    map_keyframes = u.stats.keyframes;
  });
  system.on_odometry([&](const Odometry& o) {
    const Simulating simulating;
    interval.take(o, flight.pose(o.t), T_MW);
  });
  const auto images = static_cast<std::int64_t>(wanted.hours * 3600 * kImageRate_hz);
  const auto every = static_cast<std::int64_t>(wanted.interval_hours * 3600 * kImageRate_hz);
  const auto readings_each = static_cast<int>(setup.rig.imu_noise.rate_hz / kImageRate_hz);
  const bool still = setup.lap.still;
  std::vector<Row> rows;
  fmt::print(
      "| hours | poses | restarts | MB | ms an image | p99 | error in the map, m | drift in 10 s, m | keyframes in the map |\n"
      "|---|---|---|---|---|---|---|---|---|\n");
  for (std::int64_t k = 0; k < images; ++k) {
    StereoFrame frame = setup.images[static_cast<std::size_t>(k) % setup.images.size()];
    std::vector<ImuSample> readings;
    for (int i = 0; i < readings_each; ++i) readings.push_back(flight.next_reading());
    frame.t = readings.front().t;
    const double begin_ms = cpu_ms() - simulation_ms;
    bool going = static_cast<bool>(system.push(std::move(frame)));
    for (const ImuSample& sample : readings) going = going && system.push(sample);
    interval.took(cpu_ms() - simulation_ms - begin_ms);
    if (!going) {
      fmt::print(stderr, "{}\n", system.status().error().message);
      return false;
    }
    if (k == static_cast<std::int64_t>(2 * setup.lap.length_s * kImageRate_hz)) interval.align_map(still);
    if ((k + 1) % every != 0) continue;
    rows.push_back(interval.row(static_cast<double>(k + 1) / kImageRate_hz / 3600));
    const Row& r = rows.back();
    fmt::print("| {:.2f} | {} | {} | {:.1f} | {:.2f} | {:.2f} | {:.3f} | {:.4f} | {} |\n", r.hours, interval.poses,
               interval.resets, r.memory_mb, r.mean_ms, r.p99_ms, r.map_error_m, r.drift_m, map_keyframes);
    std::fflush(stdout);
    interval.begin();
  }
  if (rows.size() < 4) return true;
  const Row &early = rows[rows.size() / 4], &late = rows.back();
  const bool flat = late.memory_mb - early.memory_mb <= kMemoryGrowth_mb && late.mean_ms <= kTimeGrowth * early.mean_ms &&
                    late.drift_m <= std::max(kDriftFloor_m, kErrorGrowth * early.drift_m) &&
                    late.map_error_m <= std::max(kErrorFloor_m, kErrorGrowth * early.map_error_m) && interval.resets == 0;
  fmt::print("\n{}\n", flat ? "flat: pass" : "not flat: FAIL");
  return flat;
}

int run(int argc, char** argv) {
  CLI::App app("hours of flight in one process: memory, time and accuracy");
  Wanted wanted;
  app.add_option("part", wanted.part, "tracks, rest or images")->check(CLI::IsMember({"tracks", "rest", "images"}));
  app.add_option("--hours", wanted.hours, "of flight")->check(CLI::PositiveNumber);
  app.add_option("--interval", wanted.interval_hours, "hours of a row, a twelfth of the flight by default");
  app.add_option("--max-keyframes", wanted.max_keyframes, "of the map");
  CLI11_PARSE(app, argc, argv);
  if (wanted.interval_hours <= 0) wanted.interval_hours = wanted.hours / 12;
  const bool images = wanted.part == "images";
  Setup setup{.rig = images ? euroc_rig() : test_room::rig(),
              .lap = {},
              .system = {},
              .frontend = nullptr,
              .images = {},
              .mapper = nullptr};
  setup.lap.still = wanted.part == "rest";
  setup.lap.length_s = images ? kImagesLap_s : kLap_s;
  if (images) setup.lap.R_vehicle_body = body_in_vehicle(setup.rig, 5);
  SplineTrajectory lap = make_lap(setup.lap);
  if (images) {
    auto rendered = render_laps(lap, setup.lap.length_s, kImageRate_hz);
    if (!rendered) {
      fmt::print(stderr, "{}\n", rendered.error().message);
      return 1;
    }
    lap = std::move(rendered->flight), setup.images = std::move(rendered->images);
  }
  EndlessFlight flight(lap, setup.lap.length_s, images ? setup.lap.length_s : 0, setup.rig.imu_noise, kStart, 1);
  LoopOptions loop;
  loop.max_keyframes = wanted.max_keyframes;
  Simulation simulated;  // what SyntheticTracks needs of one
  simulated.rig = setup.rig, simulated.flight = lap, simulated.start = kStart;
  if (images) {
    auto map = LoopMap::create(setup.rig, {.loop = loop});
    if (!map) {
      fmt::print(stderr, "{}\n", map.error().message);
      return 1;
    }
    setup.mapper = *std::move(map);
    setup.system.frontend.kind = "klt";
  } else {
    TrackOptions tracks{.recognise = true, .lap_s = setup.lap.length_s};
    if (setup.lap.still) tracks.noise_px = 0.05, tracks.slide_px = tracks.bad_share = 0, tracks.lost_share = 0.002;
    setup.frontend = std::make_unique<TracksFrontend>(simulated, tracks);
    const auto grey = std::make_shared<const Image>(setup.rig.left().width(), setup.rig.left().height(), std::uint8_t{128});
    setup.images = {StereoFrame{{}, {grey, grey}}};
    setup.mapper = std::make_unique<RoomMapper>(flight, loop);
  }
  return fly(wanted, setup, flight) ? 0 : 1;
}

}  // namespace
}  // namespace fbvins::bench

int main(int argc, char** argv) { return fbvins::bench::run(argc, argv); }
