// SPDX-License-Identifier: Apache-2.0
// Relocalisation: a map is made of a recording (all of it, or its first half), then the odometry is
// started at twenty random moments (of all of it, or of the second half) and has to relocalise in the map.
//
//   loop_relocalise DATASET...
#include <fmt/format.h>

#include <algorithm>

#include "fbvins/core/rng.hpp"
#include "fbvins/eval/alignment.hpp"
#include "fbvins/eval/association.hpp"
#include "fbvins/eval/statistics.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/vocabulary_file.hpp"
#include "fbvins/pipeline/system.hpp"

using namespace fbvins;

namespace {

constexpr int kStarts = 20;
constexpr double kGiveUp_s = 4, kInTime_s = 2, kWrong_m = 0.3;

Trajectory<W> truth_of(const Dataset& data) {
  Trajectory<W> truth;
  for (const TrajectoryPoint& p : data.ground_truth()) truth.push_back({p.t, p.T_WB});
  return truth;
}

/// Images and readings of [from, to), into the system.
void fly(const std::string& path, System& system, Time from, Time to, const auto& stop) {
  const auto data = open_dataset(path);
  while (auto event = (*data)->next()) {
    const Time t = stamp_of(*event);
    if (t < from || t >= to) continue;
    if (!system.push(std::move(*event))) break;  // finish() says why
    if (stop()) break;
  }
  if (Result<void> end = system.finish(); !end) throw std::runtime_error(end.error().message);
}

/// The map of a part of the flight, aligned with the ground truth by translation and heading.
PlaceMap map_of(const std::string& path, const Dataset& data, const Vocabulary& vocabulary, Time to) {
  LoopCloser loop(data.rig(), LoopOptions{}, vocabulary);
  System system = *System::create({}, data.rig(), RunMode::deterministic, {.mapper = &loop});
  fly(path, system, Time{0}, to, [] { return false; });
  loop.finish();
  PlaceMap map = loop.map();
  Trajectory<M> keyframes;
  for (const MapKeyframe& k : map.keyframes()) keyframes.push_back({k.t, k.T_MB});
  const auto aligned = align(associate(truth_of(data), keyframes, {}), Alignment::yaw);
  for (MapKeyframe& k : map.keyframes()) k.T_MB = *aligned * k.T_MB;
  return map;
}

struct Start {
  std::optional<double> found_after_s;  ///< from the first image
  double error_m = 0;                   ///< then
};

Start wake_up(const std::string& path, const Dataset& data, const Vocabulary& vocabulary, const PlaceMap& map, Time from) {
  LoopCloser loop(data.rig(), LoopOptions{}, vocabulary, map);
  System system = *System::create({}, data.rig(), RunMode::deterministic, {.mapper = &loop});
  std::optional<MapUpdate> found;
  Trajectory<M> in_M;
  system.on_map_update([&](const MapUpdate& u) {
    if (u.localised && !found) found = u;
  });
  system.on_odometry([&](const Odometry& o) {
    if (found && in_M.empty() && o.health.has_pose()) in_M.push_back({o.t, found->T_MG * o.gauge.T_GB});
  });
  fly(path, system, from, from + Duration::from_seconds(kGiveUp_s), [&] { return !in_M.empty(); });
  Start start;
  const auto pairs = associate(truth_of(data), in_M, {.method = AssociationMethod::interpolate_truth});
  if (pairs.empty()) return start;
  start.found_after_s = (in_M[0].t - from).seconds();
  start.error_m = (pairs[0].estimate.T.p - pairs[0].truth.T.p).norm();
  return start;
}

void measure(const std::string& path, const Dataset& data, const Vocabulary& vocabulary, bool halves) {
  const Time first = data.frames().front().t, last = data.frames().back().t;
  const Time middle = first + Duration::from_seconds(0.5 * (last - first).seconds());
  const PlaceMap map = map_of(path, data, vocabulary, halves ? middle : last);
  Rng rng(2026);
  int in_time = 0, wrong = 0;
  std::vector<double> errors_m, times_s;
  for (int i = 0; i < kStarts; ++i) {
    const Time begin = halves ? middle : first;
    const double room_s = (last - begin).seconds() - kGiveUp_s;
    const Start start = wake_up(path, data, vocabulary, map, begin + Duration::from_seconds(rng.uniform(0, room_s)));
    if (!start.found_after_s) continue;
    in_time += *start.found_after_s <= kInTime_s;
    wrong += start.error_m > kWrong_m;
    errors_m.push_back(start.error_m), times_s.push_back(*start.found_after_s);
  }
  std::sort(errors_m.begin(), errors_m.end());
  fmt::print(
      "{}, map of {} ({} keyframes): {} of {} found within {} s of the first image, {} in the end; error median {:.4f} m, "
      "largest {:.4f} m, {} beyond {} m; median {:.2f} s\n",
      data.info().name, halves ? "the first half, started in the second" : "all, started anywhere", map.size(), in_time, kStarts,
      kInTime_s, errors_m.size(), percentile(errors_m, 0.5), errors_m.empty() ? 0 : errors_m.back(), wrong, kWrong_m,
      percentile(times_s, 0.5));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const auto vocabulary = Vocabulary::open(shipped_vocabulary());
  if (!vocabulary || argc < 2) {
    fmt::print(stderr, "{}\n", argc < 2 ? "usage: loop_relocalise DATASET..." : vocabulary.error().message);
    return 2;
  }
  for (int i = 1; i < argc; ++i) {
    const auto data = open_dataset(argv[i]);
    if (!data) {
      fmt::print(stderr, "{}\n", data.error().message);
      return 2;
    }
    for (const bool halves : {false, true}) measure(argv[i], **data, *vocabulary, halves);
  }
  return 0;
}
