// SPDX-License-Identifier: Apache-2.0
// One simulated room on several days: the first day shows all of a round, each other one a part of it, under other lamps and with
// other furniture.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <stdexcept>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/pipeline/system.hpp"
#include "fbvins/sim/room_changes.hpp"
#include "fbvins/sim/simulation.hpp"
#include "fbvins/types/sensor_event.hpp"
#include "fbvins/types/trajectory.hpp"

namespace fbvins {

struct DayLook {
  const char* name;
  LampChange lamps;
  double moved_share;  ///< of the furniture, from where it was on the first day
};
/// Fixed before anything was measured.
inline constexpr std::array kDayLooks = {
    DayLook{"as built", LampChange::none, 0},         DayLook{"half of the lamps, 10 % moved", LampChange::half, 0.1},
    DayLook{"20 % moved", LampChange::none, 0.2},     DayLook{"standing lamps, 30 % moved", LampChange::standing, 0.3},
    DayLook{"sun, 10 % moved", LampChange::sun, 0.1},
};

struct Day {
  std::vector<SensorEvent> events;
  Trajectory<W> truth;
  Time begin;  ///< first image
};

struct RoomOfDays {
  static constexpr double kLater_s =
      2;  ///< a day begins so much later on the round than the one before, or where the first began
  static constexpr int kBeginnings = 3;
  SimulationOptions options;
  double seconds = 12;  ///< of a day; the first one is longer

  RoomOfDays(int seed, double seconds_a_day, int samples) : seconds(seconds_a_day) {
    options = *simulation_preset("normal");
    options.seed = seed;
    options.camera.time_samples = samples;
    options.flight.duration_s = options.flight.rest_s + seconds + (kBeginnings - 1) * kLater_s;
  }

  StereoRig rig() const { return *simulated_rig(options); }

  /// Rendered; `look`: of kDayLooks.
  Day day(int number, std::size_t look) const {
    const DayLook& change = kDayLooks[look];
    SimulationOptions o = options;
    if (change.lamps == LampChange::sun) o.world.ambient = 0.2;
    const auto simulation = prepare_simulation(o, [&](World& world, const Simulation& s) {
      std::vector<Vec3> path;
      for (double t = 0; t < s.flight.duration_s(); t += 0.1) path.push_back(s.flight.pose(t).p + s.world_from_flight);
      Rng rng(static_cast<std::uint64_t>(options.seed + 7919 * number), 71);
      move_furniture(world, change.moved_share, path, rng);
      change_lamps(world, change.lamps, rng);
    });
    if (!simulation) throw std::runtime_error(simulation.error().message);
    Simulation s = *simulation;
    if (number == 0) return events_between(s, s.start, s.start + Duration::from_seconds(options.flight.duration_s));
    const Time from = s.start + Duration::from_seconds(options.flight.rest_s + number % kBeginnings * kLater_s);
    return events_between(s, from, from + Duration::from_seconds(seconds));
  }

  static Day events_between(Simulation& s, Time from, Time to) {
    Day day;
    const Duration lead = Duration::from_seconds(0.1);
    std::size_t next = 0;
    for (std::size_t i = 0; i < s.frames.size(); ++i) {
      const Time t = s.frames[i];
      if (t < from || t >= to) continue;
      if (day.truth.empty()) day.begin = t;
      for (; next < s.imu.samples.size() && s.imu.samples[next].t <= t; ++next)
        if (s.imu.samples[next].t >= from - lead) day.events.emplace_back(s.imu.samples[next]);
      day.events.emplace_back(render_frame(s, i).frame);
      day.truth.push_back({t, s.flight.pose((t - s.start).seconds())});
    }
    const Time end = to + lead;
    for (; next < s.imu.samples.size() && s.imu.samples[next].t < end; ++next) day.events.emplace_back(s.imu.samples[next]);
    return day;
  }
};

/// Sends what lies in [from, to) through the odometry, until `stop`.
inline void fly(
    const Day& day, System& system, Time from, Time to, const std::function<bool()>& stop = [] { return false; }) {
  for (const SensorEvent& event : day.events) {
    if (stamp_of(event) < from - Duration::from_seconds(0.05) || stamp_of(event) >= to) continue;
    if (std::holds_alternative<StereoFrame>(event) && stamp_of(event) < from) continue;
    if (!system.push(event) || stop()) break;  // finish() says why
  }
  if (Result<void> end = system.finish(); !end) throw std::runtime_error(end.error().message);
}

inline std::optional<Pose<W, B>> truth_at(const Day& day, Time t) {
  for (const StampedPose<W>& p : day.truth)
    if (p.t == t) return p.T;
  return std::nullopt;
}

}  // namespace fbvins
