// SPDX-License-Identifier: Apache-2.0
// Whether loop closure delays the pose: the recording is played at its own rate through the threaded system, with and
// without loop closure, and the wall time from an image's arrival to its pose is measured. Rounds alternate,
// so that other load on the machine affects both.
//
//   loop_latency DATASET [ROUNDS]
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "fbvins/eval/statistics.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/loop/loop_map.hpp"
#include "fbvins/pipeline/system.hpp"

using namespace fbvins;
using Clock = std::chrono::steady_clock;

namespace {

/// Milliseconds from arrival to pose, frame by frame.
std::vector<double> play(const std::vector<SensorEvent>& events, const StereoRig& rig, Mapper* mapper) {
  System system = *System::create({}, rig, RunMode::threaded, {.mapper = mapper});
  std::vector<Clock::time_point> arrived(events.size());
  std::vector<double> ms;
  system.on_odometry([&](const Odometry& o) {
    const auto now = Clock::now();
    ms.push_back(std::chrono::duration<double, std::milli>(now - arrived[static_cast<std::size_t>(o.id.value)]).count());
  });
  const auto time_of = [](const SensorEvent& e) { return stamp_of(e); };
  const Time t0 = time_of(events.front());
  const auto start = Clock::now();
  std::size_t frames = 0;
  for (const SensorEvent& event : events) {
    std::this_thread::sleep_until(start + std::chrono::nanoseconds((time_of(event) - t0).ns));
    if (std::holds_alternative<StereoFrame>(event)) arrived[frames++] = Clock::now();
    if (!system.push(event)) break;  // finish() says why
  }
  if (Result<void> end = system.finish(); !end) throw std::runtime_error(end.error().message);
  return ms;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: loop_latency DATASET [ROUNDS]\n");
    return 2;
  }
  const auto data = open_dataset(argv[1]);
  if (!data) {
    fmt::print(stderr, "{}\n", data.error().message);
    return 2;
  }
  std::vector<SensorEvent> events;
  while (auto event = (*data)->next()) events.push_back(std::move(*event));
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 3;
  std::vector<double> without, with;
  for (int round = 0; round < rounds; ++round) {
    const auto a = play(events, (*data)->rig(), nullptr);
    const auto map = LoopMap::create((*data)->rig());
    if (!map) {
      fmt::print(stderr, "{}\n", map.error().message);
      return 2;
    }
    const auto b = play(events, (*data)->rig(), map->get());
    without.insert(without.end(), a.begin(), a.end());
    with.insert(with.end(), b.begin(), b.end());
  }
  for (const auto& [name, ms] : {std::pair{"without loop closure", &without}, std::pair{"with", &with}})
    fmt::print("{:<22} {} frames: from image to pose p50 {:.2f} ms, p90 {:.2f}, p99 {:.2f}, largest {:.2f}\n", name, ms->size(),
               percentile(*ms, 0.5), percentile(*ms, 0.9), percentile(*ms, 0.99), percentile(*ms, 1.0));
  return 0;
}
