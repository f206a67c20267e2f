// SPDX-License-Identifier: Apache-2.0
// What a flight in the map of a large building costs (docs/experiments/maps.md#a-building). Rooms of 8 x 6 m of synthetic points,
// two hundred keyframes each; each start is a flight of five keyframes, from anywhere.
//
//   building make --keyframes 100000 -o building.fbm
//   building fly building.fbm --starts 200 --memory-mb 50          prints a row of a Markdown table
//   building fly building.fbm --starts 200 --whole                 with the whole map in memory
//   building keep building.fbm                                     a flight of two minutes, kept every half minute
#include <fcntl.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/core/stage_timer.hpp"
#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/map_journal.hpp"
#include "fbvins/loop/vocabulary_file.hpp"
#include "tests/support/test_room.hpp"

using namespace fbvins;

namespace {

constexpr int kPointsOfARoom = 6000, kOfARoom = 200, kRoomsOfASession = 10, kKeyframesOfAStart = 5;
constexpr double kWrong_m = 0.3, kCommonWords = 2;

struct Arguments {
  std::string file;
  int keyframes = 10000, starts = 200, memory_mb = 200;
  bool whole = false, cold = false;
};

/// Points of a room, which look like what the vocabulary was trained on.
test_room::World room(int number, const Vocabulary& vocabulary) {
  Rng rng(static_cast<std::uint64_t>(number) + 1);
  test_room::World world = test_room::room(static_cast<std::uint64_t>(number) + 1, kPointsOfARoom);
  const auto centres = vocabulary.descriptors();
  for (Descriptor& look : world.looks) {
    const double u = rng.uniform();  // some words are common: two places have as many in common by chance as real ones have
    look = centres[1 + static_cast<std::size_t>(std::pow(u, kCommonWords) * static_cast<double>(centres.size() - 1))];
    for (int b = 0; b < 20; ++b) look.bits[rng.below(4)] ^= std::uint64_t{1} << rng.below(64);
  }
  return world;
}

/// Where a room's own frame lies in M: rooms side by side, on floors.
Pose<M, G> where(int number) {
  return {Quat::Identity(), Vec3(10.0 * (number % 25), 8.0 * (number / 25 % 20), 4.0 * (number / 500))};
}

MapEdge step(const MapKeyframe& from, const MapKeyframe& to) {
  Mat6 information = Mat6::Identity() * 1e4;
  information.bottomRightCorner<3, 3>() *= 10;
  return {from.id, to.id, from.T_MB.inverse() * to.T_MB, information, MapEdge::Kind::odometry};
}

int make(const Arguments& a, const Vocabulary& vocabulary) {
  PlaceMap map;
  map.cameras[0] = test_room::rig().T_BC0();
  map.vocabulary = vocabulary.fingerprint();
  test_room::World world;
  for (int i = 0; i < a.keyframes; ++i) {
    const int number = i / kOfARoom, in_room = i % kOfARoom;
    if (in_room == 0) world = room(number, vocabulary);
    Rng rng(static_cast<std::uint64_t>(i) + 1'000'000);
    MapKeyframe k;
    k.t = Time{} + Duration::from_seconds(0.2 * i);
    k.session = static_cast<std::uint32_t>(number / kRoomsOfASession);
    k.T_GB = test_room::true_pose(0.2 * in_room);
    k.T_MB = where(number) * k.T_GB;
    k.path_m = i;
    k.place = test_room::view(world, k.T_GB, rng);
    k.place.words = vocabulary.words_of(k.place.descriptors);
    k.id = map.add(std::move(k));
    if (i > 0) map.edges.push_back(step(map.keyframes()[static_cast<std::size_t>(i) - 1], map.keyframes().back()));
  }
  if (Result<void> saved = save_map(map, a.file); !saved) {
    fmt::print(stderr, "{}\n", saved.error().message);
    return 2;
  }
  fmt::print("{}: {} keyframes, {:.0f} MB\n", a.file, map.size(), static_cast<double>(std::filesystem::file_size(a.file)) / 1e6);
  return 0;
}

class Stopwatch {
 public:
  double lap_ms() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - start_).count();
    start_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// "VmRSS" or "VmHWM" of this process.
double memory_mb(const std::string& which) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with(which)) return std::stod(line.substr(which.size() + 1)) / 1000;
  return 0;
}

/// What the operating system keeps of the file leaves memory.
void forget(const std::string& file) {
  const FileDescriptor open(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  if (open) (void)::posix_fadvise(open.number(), 0, 0, POSIX_FADV_DONTNEED);
}

std::string spread(std::vector<double>& ms) {
  if (ms.empty()) return "-";
  std::ranges::sort(ms);
  return fmt::format("{:.1f}, {:.1f}, {:.1f}", ms[ms.size() / 2], ms[ms.size() * 99 / 100], ms.back());
}

struct Costs {
  std::vector<double> anywhere_ms, anywhere_cpu_ms, around_ms, around_cpu_ms, keyframe_ms;
  int found = 0, wrong = 0;
};

/// A flight that begins anywhere, in a frame of its own.
void start(const Arguments& a, const Vocabulary& vocabulary, LoopCloser& closer, CandidateSearch& search, int number, int rooms,
           Costs& costs) {
  Rng rng(static_cast<std::uint64_t>(number) + 5'000'000);
  const int at = static_cast<int>(rng.below(static_cast<std::uint32_t>(rooms)));
  const test_room::World world = room(at, vocabulary);
  const double begin_s = rng.uniform(0, 0.2 * (kOfARoom - kKeyframesOfAStart));
  const Pose<G, G> elsewhere(about_z(rng.uniform(-3, 3)), Vec3(5, -3, 1));
  bool found = false, wrong = false;
  for (int i = 0; i < kKeyframesOfAStart; ++i) {
    const Pose<G, B> truth = test_room::true_pose(begin_s + 0.4 * i);
    Place place = test_room::view(world, truth, rng);
    place.words = vocabulary.words_of(place.descriptors);
    MapKeyframe query;
    query.t = Time{1'000'000'000'000'000} + Duration::from_seconds(10.0 * number + 0.4 * i);
    query.session = 1'000'000;
    query.T_MB = where(at) * truth;
    query.place = place;
    if (a.cold) forget(a.file);
    Stopwatch watch;
    CpuTimer cpu;
    (void)search.anywhere(closer.map(), query);
    costs.anywhere_ms.push_back(watch.lap_ms()), costs.anywhere_cpu_ms.push_back(cpu.lap_ms());
    if (a.cold) forget(a.file), watch.lap_ms(), cpu.lap_ms();
    (void)search.around(closer.map(), query, 0.05);
    costs.around_ms.push_back(watch.lap_ms()), costs.around_cpu_ms.push_back(cpu.lap_ms());
    if (a.cold) forget(a.file);
    const Keyframe k = test_room::keyframe(FrameId{kKeyframesOfAStart * number + i}, query.t, elsewhere * truth,
                                           static_cast<std::uint32_t>(number));
    watch.lap_ms();
    const MapUpdate update = closer.process(std::move(place), k);
    costs.keyframe_ms.push_back(watch.lap_ms());
    if (!update.localised) continue;
    found = true;
    wrong = wrong || ((update.T_MG * k.gauge.T_GB).p - query.T_MB.p).norm() > kWrong_m;
  }
  costs.found += found, costs.wrong += wrong;
}

int fly(const Arguments& a, const Vocabulary& vocabulary) {
  if (a.cold) forget(a.file);
  Stopwatch watch;
  constexpr std::uint64_t kMB = 1'000'000;
  Result<PlaceMap> map = a.whole ? load_map(a.file) : open_map(a.file, kMB * static_cast<std::uint64_t>(a.memory_mb));
  if (!map) {
    fmt::print(stderr, "{}\n", map.error().message);
    return 2;
  }
  LoopOptions options;
  options.max_keyframes = 1'000'000;
  const int keyframes = static_cast<int>(map->size());
  LoopCloser closer(test_room::rig(), options, vocabulary, *std::move(map));
  const double open_s = watch.lap_ms() / 1000, opened_mb = memory_mb("VmRSS");
  // Another index of the same map, for its own times.
  CandidateSearch search(vocabulary.words(), options.max_distance_m);
  if (closer.map().store) search.add(closer.map().store);
  for (const MapKeyframe& k : closer.map().keyframes())
    if (k.stored < 0) search.add(k.id, k.place.words);
  Costs costs;
  for (int i = 0; i < a.starts; ++i) start(a, vocabulary, closer, search, i, keyframes / kOfARoom, costs);
  fmt::print("| {} | {:.0f} | {} | {:.2f} | {:.0f} | {:.0f} | {}; CPU {} | {}; CPU {} | {} | {} of {} | {} |\n", keyframes,
             static_cast<double>(std::filesystem::file_size(a.file)) / 1e6,
             a.whole ? "all" : fmt::format("{}{}", a.memory_mb, a.cold ? ", cold" : ""), open_s, opened_mb, memory_mb("VmHWM"),
             spread(costs.anywhere_ms), spread(costs.anywhere_cpu_ms), spread(costs.around_ms), spread(costs.around_cpu_ms),
             spread(costs.keyframe_ms), costs.found, a.starts, costs.wrong);
  return closer.map().store && closer.map().store->damage() ? 2 : 0;
}

/// A flight that is kept in a journal, as `fbvins live --map` does.
int keep(const Arguments& a, const Vocabulary& vocabulary) {
  constexpr int kPieces = 4, kOfAPiece = 150;  // five keyframes a second
  constexpr std::uint64_t kMB = 1'000'000;
  Result<PlaceMap> map = open_map(a.file, kMB * static_cast<std::uint64_t>(a.memory_mb));
  if (!map) return fmt::print(stderr, "{}\n", map.error().message), 2;
  LoopOptions options;
  options.max_keyframes = 1'000'000;
  const std::size_t keyframes = map->size();
  LoopCloser closer(test_room::rig(), options, vocabulary, *std::move(map));
  MapJournal journal;
  Rng rng(5);
  const test_room::World world = room(0, vocabulary);
  for (int i = 0; i < kPieces * kOfAPiece; ++i) {
    const Pose<G, B> truth = test_room::true_pose(0.1 + 0.2 * i);
    Place place = test_room::view(world, truth, rng);
    place.words = vocabulary.words_of(place.descriptors);
    const Time t = Time{1'000'000'000'000'000} + Duration::from_seconds(0.2 * i);
    (void)closer.process(std::move(place), test_room::keyframe(FrameId{i}, t, truth));
    if (i % kOfAPiece < kOfAPiece - 1) continue;
    CpuTimer cpu;
    const std::optional<PlaceMap> reduced = closer.reduced();
    const double judged_ms = cpu.lap_ms();
    const Result<std::string> news = journal.news(reduced ? *reduced : closer.map());
    const double made_ms = cpu.lap_ms();
    Stopwatch watch;
    if (!news || !write_map_bytes(a.file, *news)) return fmt::print(stderr, "{}: cannot be kept\n", a.file), 2;
    fmt::print("| {} | {:.0f} | {} | {:.2f} | {:.0f} | {:.0f} | {:.0f} |\n", keyframes,
               static_cast<double>(std::filesystem::file_size(a.file)) / 1e6, closer.map().size() - keyframes,
               static_cast<double>(news->size()) / 1e6, judged_ms, made_ms, watch.lap_ms());
  }
  Stopwatch watch;
  const Result<PlaceMap> again = open_map(a.file, kMB * static_cast<std::uint64_t>(a.memory_mb));
  fmt::print("opened again with {} keyframes in {:.2f} s\n", again ? again->size() : 0, watch.lap_ms() / 1000);
  remove_journal(a.file);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("cost of a flight in the map of a large building");
  app.require_subcommand(1);
  Arguments a;
  CLI::App* making = app.add_subcommand("make", "writes the map");
  making->add_option("--keyframes", a.keyframes)->check(CLI::PositiveNumber);
  making->add_option("-o,--output", a.file)->required();
  CLI::App* flying = app.add_subcommand("fly", "one row of a table");
  flying->add_option("map", a.file)->required();
  flying->add_option("--starts", a.starts)->check(CLI::PositiveNumber);
  flying->add_option("--memory-mb", a.memory_mb)->check(CLI::NonNegativeNumber);
  flying->add_flag("--whole", a.whole, "all of the map in memory");
  flying->add_flag("--cold", a.cold, "the operating system forgets the file before each query");
  CLI::App* keeping = app.add_subcommand("keep", "rows of a table: one for each half minute");
  keeping->add_option("map", a.file)->required();
  keeping->add_option("--memory-mb", a.memory_mb)->check(CLI::NonNegativeNumber);
  CLI11_PARSE(app, argc, argv);
  const auto vocabulary = Vocabulary::open(shipped_vocabulary());
  if (!vocabulary) {
    fmt::print(stderr, "{}\n", vocabulary.error().message);
    return 2;
  }
  if (keeping->parsed()) return keep(a, *vocabulary);
  return making->parsed() ? make(a, *vocabulary) : fly(a, *vocabulary);
}
