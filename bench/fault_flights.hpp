// SPDX-License-Identifier: Apache-2.0
// Flights for the campaign of faults: recorded ones, and simulated ones of tracks alone.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/faulty_tracks.hpp"
#include "fbvins/eval/alignment.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins::bench {

struct Flight {
  std::string name;
  StereoRig rig;
  std::vector<SensorEvent> events;
  std::vector<StampedPose<AnyWorld>> truth;
  Time begin, end;
  std::shared_ptr<const Simulation> simulation = nullptr;  ///< of tracks
};

inline Result<Flight> load(const std::string& path) {
  auto opened = open_dataset(path);
  if (!opened) return opened.error();
  Dataset& data = **opened;
  Flight flight{path.substr(path.find_last_of('/', path.size() - 2) + 1), data.rig(), {}, {}, {}, {}};
  while (auto event = data.next()) flight.events.push_back(*std::move(event));
  for (const TrajectoryPoint& p : data.ground_truth()) flight.truth.push_back({p.t, {p.T_WB.q, p.T_WB.p}});
  if (flight.events.empty() || flight.truth.size() < 2)
    return Error{ErrorCode::invalid_argument, fmt::format("{}: a flight with ground truth is needed", path)};
  flight.begin = stamp_of(flight.events.front()), flight.end = stamp_of(flight.events.back());
  return flight;
}

/// A flight of tracks: its events in order, its images faulty_frame()s.
inline Result<Flight> prepare(const std::string& text, double seconds) {
  const std::size_t at = text.find_last_of('@');
  auto options = simulation_preset(at == std::string::npos ? text : "normal");
  if (!options) return options.error();
  if (at != std::string::npos) {
    const std::string folder = text.substr(0, at);
    options->recorded = {folder + "/groundtruth.csv", folder + "/imu0.csv", std::stod(text.substr(at + 1)), 1.0};
  }
  options->flight.duration_s = seconds;
  auto made = prepare_simulation(*options);
  if (!made) return made.error();
  const auto simulation = std::make_shared<const Simulation>(*std::move(made));
  Flight flight{text.substr(text.find_last_of('/', at - 2) + 1), simulation->rig, {}, {}, {}, {}, simulation};
  std::size_t frame = 0;
  const auto add_frames = [&](Time until) {
    for (; frame < simulation->frames.size() && simulation->frames[frame] <= until; ++frame)
      flight.events.emplace_back(faulty_frame(simulation->frames[frame]));
  };
  for (const ImuSample& sample : simulation->imu.samples) add_frames(sample.t), flight.events.emplace_back(sample);
  flight.begin = stamp_of(flight.events.front()), flight.end = stamp_of(flight.events.back());
  for (const TrueState& state : simulation->imu.truth) {
    const Pose<W, B> T = simulation->flight.pose((state.t - simulation->start).seconds());
    flight.truth.push_back({state.t, {T.q, T.p}});
  }
  return flight;
}

inline std::optional<Pose<AnyWorld, B>> truth_at(const Flight& flight, Time t) {
  const auto next = std::lower_bound(flight.truth.begin(), flight.truth.end(), t, [](const auto& p, Time x) { return p.t < x; });
  if (next == flight.truth.begin() || next == flight.truth.end()) return std::nullopt;
  const auto &a = *(next - 1), &b = *next;
  const double u = (t - a.t).seconds() / (b.t - a.t).seconds();
  return Pose<AnyWorld, B>{a.T.q.slerp(u, b.T.q), Vec3((1 - u) * a.T.p + u * b.T.p)};
}

}  // namespace fbvins::bench
