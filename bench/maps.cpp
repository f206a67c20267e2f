// SPDX-License-Identifier: Apache-2.0
// What a map is worth over many flights (docs/experiments/maps.md). Simulated rooms; prints Markdown.
//
//   maps days --days 10 --seconds 12 --seed 1       flights in one room, under other light and furniture each day
//   maps strangers --rooms 33 --seed 7001           flights in the maps of other rooms: none must join
//   maps lost --seed 1                              sensors off while the vehicle is carried: found again in the same map?
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/room_days.hpp"
#include "fbvins/config/config.hpp"
#include "fbvins/eval/alignment.hpp"
#include "fbvins/eval/association.hpp"
#include "fbvins/eval/evaluation.hpp"
#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/place_extractor.hpp"
#include "fbvins/loop/vocabulary_file.hpp"
#include "fbvins/sim/still_room.hpp"

using namespace fbvins;

namespace {

constexpr double kStartEvery_s = 2, kGiveUp_s = 4, kInTime_s = 2, kWrong_m = 0.3;

struct Arguments {
  int days = 10, seed = 1, rooms = 33, samples = 3, keyframes = 20;
  double seconds = 12;
  bool same_look = false;
};

Config flight_config() {
  Config config;
  config.frontend.kind = "orb";
  return config;
}

PlaceMap as_saved(const PlaceMap& map) {
  const std::string bytes = serialise_map(map);
  auto read = parse_map(std::as_bytes(std::span(bytes)), "the map");
  if (!read) throw std::runtime_error(read.error().message);
  return *std::move(read);
}

double error_m(const Day& day, const Trajectory<M>& in_M) {
  const auto e = evaluate(day.truth, in_M, {.association = {}, .alignment = Alignment::none});
  return e ? e->absolute_m.rmse : -1;
}

struct Flown {
  Trajectory<M> causal, after;
  int keyframes = 0;
  std::optional<double> found_s;
};

/// A flight in the map of `closer`, to its end.
Flown fly_in(LoopCloser& closer, const StereoRig& rig, const Day& day) {
  Flown out;
  System system = *System::create(flight_config(), rig, RunMode::deterministic, {.mapper = &closer});
  std::optional<MapUpdate> known;
  Trajectory<G> in_G;
  system.on_map_update([&](const MapUpdate& u) {
    ++out.keyframes;
    if (u.localised) known = u;
    if (u.found && !out.found_s) out.found_s = (u.t - day.begin).seconds();
  });
  system.on_odometry([&](const Odometry& o) {
    if (!o.health.has_pose()) return;
    in_G.push_back({o.t, o.gauge.T_GB});
    if (known && known->reset_counter == o.reset_counter) out.causal.push_back({o.t, known->T_MG * o.gauge.T_GB});
  });
  fly(day, system, day.begin, Time{INT64_MAX});
  closer.finish();
  out.after = closer.corrected(in_G);
  return out;
}

struct Start {
  std::optional<double> found_s;
  double error_m = 0;
};

/// The odometry starts in the middle of the flight: when does it know where it is, and how well?
Start wake_up(const StereoRig& rig, const Vocabulary& vocabulary, const PlaceMap& map, const Day& day, Time from) {
  LoopCloser closer(rig, {}, vocabulary, map);
  System system = *System::create(flight_config(), rig, RunMode::deterministic, {.mapper = &closer});
  std::optional<MapUpdate> found;
  Start start;
  system.on_map_update([&](const MapUpdate& u) {
    if (u.found) found = u;
  });
  system.on_odometry([&](const Odometry& o) {
    if (!found || start.found_s || !o.health.has_pose()) return;
    start.found_s = (o.t - from).seconds();
    start.error_m = ((found->T_MG * o.gauge.T_GB).p - truth_at(day, o.t)->p).norm();
  });
  fly(day, system, from, from + Duration::from_seconds(kGiveUp_s), [&] { return start.found_s.has_value(); });
  return start;
}

/// M becomes the truth's frame, by translation and heading.
void align_with_truth(PlaceMap& map, const Day& day) {
  Trajectory<M> keyframes;
  for (const MapKeyframe& k : map.keyframes()) keyframes.push_back({k.t, k.T_MB});
  const auto aligned = align(associate(day.truth, keyframes, {}), Alignment::yaw);
  for (MapKeyframe& k : map.keyframes()) k.T_MB = *aligned * k.T_MB;
}

void days(const Arguments& a, const Vocabulary& vocabulary) {
  const RoomOfDays room(a.seed, a.seconds, a.samples);
  const StereoRig rig = room.rig();
  fmt::print("seed {}, {} days of {} s\n\n", a.seed, a.days, a.seconds);
  fmt::print(
      "| day | look | keyframes flown | in the map | kB | loops | found in time | wrong | in M, in flight [m] | after [m] | joined |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|---|---|\n");
  PlaceMap map;
  int starts = 0, in_time = 0, wrong = 0;
  for (int d = 0; d < a.days; ++d) {
    const std::size_t look = a.same_look ? 0 : static_cast<std::size_t>(d) % kDayLooks.size();
    const Day day = room.day(d, look);
    int tried = 0, found = 0;
    for (double s = 0; d > 0 && s + kGiveUp_s <= a.seconds; s += kStartEvery_s) {
      const Start start = wake_up(rig, vocabulary, map, day, day.begin + Duration::from_seconds(s));
      ++tried;
      found += start.found_s && *start.found_s <= kInTime_s;
      wrong += start.found_s && start.error_m > kWrong_m;
    }
    starts += tried, in_time += found;
    LoopCloser closer(rig, {}, vocabulary, map);
    const Flown flown = fly_in(closer, rig, day);
    const auto objections = closer.objections();
    const auto reduced = closer.reduced();
    map = as_saved(reduced ? *reduced : closer.map());
    if (d == 0) align_with_truth(map, day);
    const auto loops = std::ranges::count_if(map.edges, [](const MapEdge& e) { return e.kind == MapEdge::Kind::loop; });
    fmt::print("| {} | {} | {} | {} | {} | {} | {} of {} | {} | {:.4f} | {:.4f} | {} |\n", d + 1, kDayLooks[look].name,
               flown.keyframes, map.size(), serialise_map(map).size() / 1000, loops, found, tried, wrong,
               d == 0 ? 0 : error_m(day, flown.causal), d == 0 ? 0 : error_m(day, flown.after),
               objections.empty() ? "yes" : objections.begin()->second);
    std::fflush(stdout);
  }
  fmt::print("\n{} of {} starts found within {} s\n", in_time, starts, kInTime_s);
}

struct SeenView {
  Pose<W, B> T_WB;
  Place place;
};
std::vector<SeenView> look(const StillRoom& still, const Vocabulary& vocabulary) {
  PlaceExtractor extractor(still.rig(), {}, vocabulary);
  std::vector<SeenView> seen;
  const std::vector<RenderedFrame> frames = still.render(still.views(), {});
  for (std::size_t i = 0; i < frames.size(); ++i)
    seen.push_back({still.views()[i], extractor.extract(frames[i].frame, still.views()[i].R())});
  return seen;
}

struct StrangeRoom {
  std::vector<SeenView> views;
  PlaceMap map;
};

Keyframe keyframe_of(const SeenView& view, std::size_t i) {
  Keyframe k;
  k.id = FrameId{static_cast<std::int64_t>(i)};
  k.t = Time{0} + Duration::from_seconds(0.5 * static_cast<double>(i));
  k.gauge.T_GB = {view.T_WB.q, view.T_WB.p};
  return k;
}

/// Whether the flight through every second view (from `first` on) found itself in the map, and joined it.
std::pair<bool, bool> try_in(const StereoRig& rig, const Vocabulary& vocabulary, const PlaceMap& map, const StrangeRoom& flown,
                             std::size_t most) {
  LoopCloser closer(rig, {}, vocabulary, map);
  bool found = false;
  for (std::size_t i = 1; i < flown.views.size() && i / 2 < most; i += 2)
    found = closer.process(flown.views[i].place, keyframe_of(flown.views[i], i)).localised || found;
  closer.finish();
  const auto reduced = closer.reduced();
  return {found, as_saved(reduced ? *reduced : closer.map()).sessions.size() > 1};
}

void strangers(const Arguments& a, const Vocabulary& vocabulary) {
  std::vector<StrangeRoom> rooms;
  StereoRig rig = euroc_rig();
  for (int r = 0; r < a.rooms; ++r) {
    SimulationOptions options = *simulation_preset(r % 4 == 3 ? "hall" : "normal");
    options.seed = a.seed + r;
    options.camera.time_samples = a.samples;
    const auto still = StillRoom::build(options, 0.5);
    if (!still) throw std::runtime_error(still.error().message);
    StrangeRoom room{look(*still, vocabulary), {}};
    LoopCloser closer(still->rig(), {}, vocabulary);
    for (std::size_t i = 0; i < room.views.size(); i += 2) closer.process(room.views[i].place, keyframe_of(room.views[i], i));
    closer.finish();
    room.map = as_saved(closer.map());
    rooms.push_back(std::move(room));
  }
  int tries = 0, found = 0, joined = 0, own = 0, own_joined = 0;
  for (std::size_t m = 0; m < rooms.size(); ++m)
    for (std::size_t f = 0; f < rooms.size(); ++f) {
      const auto [in_map, in_file] = try_in(rig, vocabulary, rooms[m].map, rooms[f], static_cast<std::size_t>(a.keyframes));
      if (m == f) own += in_map, own_joined += in_file;
      else ++tries, found += in_map, joined += in_file;
    }
  fmt::print(
      "{} rooms from seed {}: of {} flights in maps of other rooms {} were localised and {} joined; of {} in their own {} and {}\n",
      a.rooms, a.seed, tries, found, joined, a.rooms, own, own_joined);
}

void lost(const Arguments& a, const Vocabulary& vocabulary) {
  constexpr double kFlown_s = 10, kCarried_s = 5, kAgain_s = 5;
  const RoomOfDays room(a.seed, kFlown_s + a.days * (kCarried_s + kAgain_s), a.samples);
  const StereoRig rig = room.rig();
  const Day day = room.day(0, 0);
  const auto off = [&](Time t) {
    const double s = (t - day.begin).seconds() - room.options.flight.rest_s - kFlown_s;
    return s > 0 && std::fmod(s, kCarried_s + kAgain_s) < kCarried_s;
  };
  LoopCloser closer(rig, {}, vocabulary);
  System system = *System::create(flight_config(), rig, RunMode::deterministic, {.mapper = &closer});
  std::optional<MapUpdate> known;
  std::optional<Time> on_again;
  Trajectory<M> first, seen;
  std::vector<double> found_s, errors;
  int gaps = 0;
  system.on_map_update([&](const MapUpdate& u) {
    known = u;
    if (u.found && on_again) found_s.push_back((u.t - *on_again).seconds());
    if (u.M_moved)
      for (StampedPose<M>& p : first) p.T = *u.M_moved * p.T;
  });
  system.on_odometry([&](const Odometry& o) {
    if (!o.health.has_pose() || !known || !known->localised || known->reset_counter != o.reset_counter) return;
    (gaps == 0 ? first : seen).push_back({o.t, known->T_MG * o.gauge.T_GB});
  });
  bool was_off = false;
  for (const SensorEvent& event : day.events) {
    const Time t = stamp_of(event);
    if (off(t)) was_off = true;
    else if (was_off && std::holds_alternative<StereoFrame>(event)) was_off = false, on_again = t, ++gaps;
    if (!off(t) && !system.push(event)) break;
  }
  if (Result<void> end = system.finish(); !end) throw std::runtime_error(end.error().message);
  const auto aligned = align(associate(day.truth, first, {}), Alignment::yaw);
  for (StampedPose<M>& p : seen) {
    p.T = *aligned * p.T;
    if (const auto truth = truth_at(day, p.t)) errors.push_back((p.T.p - truth->p).norm());
  }
  std::sort(errors.begin(), errors.end());
  fmt::print("seed {}: carried {} times for {} s without sensors; found again {} times, after", a.seed, gaps, kCarried_s,
             found_s.size());
  for (const double s : found_s) fmt::print(" {:.2f}", s);
  fmt::print(" s; error in the M of before: median {:.4f} m, largest {:.4f} m\n", errors.empty() ? -1 : errors[errors.size() / 2],
             errors.empty() ? -1 : errors.back());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("What a map is worth over many flights, in simulated rooms.");
  Arguments arguments;
  app.require_subcommand(1);
  const auto add = [&](const char* name, const char* about, void (*run)(const Arguments&, const Vocabulary&)) {
    CLI::App* command = app.add_subcommand(name, about);
    command->add_option("--seed", arguments.seed);
    command->add_option("--samples", arguments.samples, "rays per pixel")->check(CLI::PositiveNumber);
    command->add_option("--days", arguments.days, "days; of lost: how often the vehicle is carried")->check(CLI::PositiveNumber);
    command->add_option("--seconds", arguments.seconds, "of a day")->check(CLI::PositiveNumber);
    command->add_option("--rooms", arguments.rooms)->check(CLI::PositiveNumber);
    command->add_option("--keyframes", arguments.keyframes, "of a flight in a stranger's map")->check(CLI::PositiveNumber);
    command->add_flag("--same-look", arguments.same_look, "nothing changes from day to day");
    command->callback([&arguments, run] {
      auto vocabulary = open_vocabulary(kRawDescriptors, "");
      if (!vocabulary) throw std::runtime_error(vocabulary.error().message);
      run(arguments, *vocabulary);
    });
  };
  add("days", "flights in one room, under other light and furniture each day", days);
  add("strangers", "flights in the maps of other rooms", strangers);
  add("lost", "carried while the sensors are off", lost);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
  return 0;
}
