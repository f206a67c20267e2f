// SPDX-License-Identifier: Apache-2.0
// Are rooms known again after what changes in months: lamps, sun, exposure, furniture, viewpoint? Keyframes of simulated rooms
// make one map; each room is seen again under every change. Raw descriptors against boosted ones, each with its own vocabulary.
//
//   place_changes --rooms 20 --seed 6001
//   place_changes --rooms 8 --seed 5001 --try 60,28,0.16 --try 68,24,0.12        thresholds: bits, inliers, share of the visible
//   place_changes --boosted new.safetensors,new_vocabulary.fbv                  other weights beside those that ship
//
// "known": one of the map's candidates by words gives the right pose; "verifiable": any keyframe of the room does. "wrong": pairs
// of all views of the room and some of others whose accepted pose is not the true one. Prints Markdown.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "bench/changed_rooms.hpp"
#include "fbvins/core/angle.hpp"
#include "fbvins/core/median.hpp"
#include "fbvins/loop/candidate_search.hpp"
#include "fbvins/loop/loop_options.hpp"
#include "fbvins/loop/place_verifier.hpp"
#include "fbvins/loop/vocabulary_file.hpp"

using namespace fbvins;

namespace {

constexpr double kRight_m = 0.2, kRight_rad = 5 * kDegree;
constexpr std::size_t kOthers = 16;  // keyframes of other rooms tried with each query
constexpr std::uint32_t kOtherSession = 1'000'000;

struct Arguments {
  int rooms = 12, seed = 6001, threads = 2, samples = 3;
  std::vector<std::string> boosted, settings;
  std::string accepted;
};

struct Setting {
  std::string name;
  std::size_t kind;
  PlaceVerifierOptions options;
};

/// Error of the query's pose in M; none in the wrong room.
struct PoseError {
  double m = 1e3, rad = 3.2;
  bool right() const { return m < kRight_m && rad < kRight_rad; }
};

struct AcceptedPair {
  std::size_t room, query;
  KeyframeId keyframe;
  bool candidate;  ///< by words
  int inliers, visible;
  PoseError error;
};

struct Row {
  int queries = 0, known = 0, verifiable = 0, pairs = 0;
  std::vector<AcceptedPair> accepted;
  std::vector<PoseError> errors;  ///< of the known

  void add(const Row& other) {
    queries += other.queries, known += other.known, verifiable += other.verifiable, pairs += other.pairs;
    accepted.insert(accepted.end(), other.accepted.begin(), other.accepted.end());
    errors.insert(errors.end(), other.errors.begin(), other.errors.end());
  }
  long wrong() const {
    return std::count_if(accepted.begin(), accepted.end(), [](const AcceptedPair& a) { return !a.error.right(); });
  }
};
using Table = std::array<Row, kConditions.size()>;

void in_parallel(int threads, std::size_t count, const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next{0};
  std::vector<std::thread> workers;
  for (int w = 0; w < threads; ++w)
    workers.emplace_back([&] {
      for (std::size_t i = next++; i < count; i = next++) work(i);
    });
  for (std::thread& worker : workers) worker.join();
}

struct MapOfRooms {
  PlaceMap map;
  std::vector<std::vector<KeyframeId>> of_room;
};

MapKeyframe keyframe_of(const SeenView& seen, std::size_t kind, std::uint32_t session, Time t) {
  MapKeyframe k;
  k.t = t;
  k.session = session;
  k.T_GB = {seen.T_WB.q, seen.T_WB.p};
  k.T_MB = {seen.T_WB.q, seen.T_WB.p};
  k.place = seen.places[kind];
  return k;
}

MapOfRooms map_of(const std::vector<SeenRoom>& rooms, std::size_t kind, CandidateSearch& search) {
  MapOfRooms all;
  for (std::size_t r = 0; r < rooms.size(); ++r) {
    all.of_room.emplace_back();
    for (std::size_t i = 0; i < rooms[r].map.size(); ++i) {
      const Time t = Time{0} + Duration::from_seconds(kMapEvery_s * static_cast<double>(i));
      const KeyframeId id = all.map.add(keyframe_of(rooms[r].map[i], kind, static_cast<std::uint32_t>(r), t));
      search.add(id, rooms[r].map[i].places[kind].words);
      all.of_room.back().push_back(id);
    }
  }
  return all;
}

PoseError error_of(const VerifiedPose& found, const MapKeyframe& from, const SeenView& query, const Pose<B, C0>& T_BC0) {
  const Pose<M, C0> T_MQ = from.T_MB * T_BC0 * found.pose.T_qc.inverse();
  const Pose<W, C0> truth = query.T_WB * T_BC0;
  return {(T_MQ.p - truth.p).norm(), so3_log((T_MQ.q.conjugate() * truth.q).normalized()).norm()};
}

/// Every keyframe of the query's room, some of others, and those that the words propose.
std::vector<KeyframeId> tried_with(const MapOfRooms& all, std::size_t room, std::size_t query,
                                   const std::vector<KeyframeId>& candidates) {
  std::vector<KeyframeId> tried = all.of_room[room];
  const std::size_t step = std::max<std::size_t>(1, all.map.size() / kOthers);
  for (std::size_t i = query % step; i < all.map.size(); i += step) tried.push_back(all.map.keyframes()[i].id);
  tried.insert(tried.end(), candidates.begin(), candidates.end());
  std::sort(tried.begin(), tried.end());
  tried.erase(std::unique(tried.begin(), tried.end()), tried.end());
  return tried;
}

struct Query {
  std::size_t room, number;
  const SeenView& seen;
  const Place& place;
  const std::vector<KeyframeId>& candidates;
};

void ask(const MapOfRooms& all, const Query& query, const Pose<B, C0>& T_BC0, PlaceVerifier& verifier, Row& row) {
  verifier.set_query(query.place);
  bool verifiable = false;
  std::optional<PoseError> known;
  for (const KeyframeId id : tried_with(all, query.room, query.number, query.candidates)) {
    const MapKeyframe& k = *all.map.find(id);
    ++row.pairs;
    const auto verified = verifier.verify(k.place);
    if (!verified) continue;
    const PoseError error = k.session == query.room ? error_of(*verified, k, query.seen, T_BC0) : PoseError{};
    const bool candidate = std::count(query.candidates.begin(), query.candidates.end(), id) > 0;
    const auto inliers = static_cast<int>(verified->pose.inliers.size());
    row.accepted.push_back({query.room, query.number, id, candidate, inliers, verified->visible, error});
    verifiable = verifiable || error.right();
    if (candidate && error.right() && !known) known = error;
  }
  ++row.queries;
  row.verifiable += verifiable;
  row.known += known.has_value();
  if (known) row.errors.push_back(*known);
}

Table measure(int threads, const std::vector<SeenRoom>& rooms, const Setting& setting, const DescriptorKind& kind) {
  const Pose<B, C0> T_BC0 = euroc_rig().T_BC0;
  CandidateSearch search(kind.vocabulary.words(), LoopOptions{}.max_distance_m);
  const MapOfRooms all = map_of(rooms, setting.kind, search);
  // The search has one thread, verification many.
  std::vector<std::array<std::vector<std::vector<KeyframeId>>, kConditions.size()>> candidates(rooms.size());
  for (std::size_t r = 0; r < rooms.size(); ++r)
    for (std::size_t c = 0; c < kConditions.size(); ++c)
      for (const SeenView& seen : rooms[r].again[c])
        candidates[r][c].push_back(search.anywhere(all.map, keyframe_of(seen, setting.kind, kOtherSession, Time{0})));
  std::vector<Table> of_room(rooms.size());
  in_parallel(threads, rooms.size(), [&](std::size_t r) {
    PlaceVerifier verifier(setting.options);
    for (std::size_t c = 0; c < kConditions.size(); ++c)
      for (std::size_t i = 0; i < rooms[r].again[c].size(); ++i) {
        const SeenView& seen = rooms[r].again[c][i];
        ask(all, {r, i, seen, seen.places[setting.kind], candidates[r][c][i]}, T_BC0, verifier, of_room[r][c]);
      }
  });
  Table sum;
  for (const Table& table : of_room)
    for (std::size_t c = 0; c < kConditions.size(); ++c) sum[c].add(table[c]);
  return sum;
}

double median_part(const std::vector<PoseError>& errors, double PoseError::*part) {
  if (errors.empty()) return 0;
  std::vector<double> values;
  for (const PoseError& e : errors) values.push_back(e.*part);
  return median(values);
}

std::string described(const Setting& setting) {
  return fmt::format("{}: {} bits, {} inliers, {:.2f} of the visible", setting.name, setting.options.max_distance_bit,
                     setting.options.min_inliers, setting.options.min_visible_share);
}

void print_row(const char* name, const Row& r) {
  const double queries = std::max(r.queries, 1);
  const double error_mm = 1e3 * median_part(r.errors, &PoseError::m),
               error_deg = median_part(r.errors, &PoseError::rad) / kDegree;
  fmt::print("| {} | {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.2f} | {} | {} |\n", name, r.queries, r.known,
             100 * r.known / queries, 100 * r.verifiable / queries, error_mm, error_deg, r.pairs, r.wrong());
}

void print(const Setting& setting, const Table& table) {
  fmt::print("\n{}\n\n", described(setting));
  fmt::print("| change | queries | known | % | verifiable % | error [mm] | [deg] | pairs | wrong |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|\n");
  Row all;
  for (std::size_t c = 0; c < table.size(); ++c) print_row(kConditions[c].name, table[c]), all.add(table[c]);
  print_row("all", all);
  std::fflush(stdout);
}

void write_accepted(std::FILE* file, const Setting& setting, const Table& table) {
  for (std::size_t c = 0; c < table.size(); ++c)
    for (const AcceptedPair& a : table[c].accepted)
      fmt::print(file, "{};{};{};{};{};{};{};{};{:.4f};{:.3f}\n", described(setting), kConditions[c].name, a.room, a.query,
                 a.keyframe.value, a.candidate ? 1 : 0, a.inliers, a.visible, a.error.m, a.error.rad / kDegree);
}

std::vector<DescriptorKind> kinds_of(const Arguments& arguments) {
  const auto kind = [](const std::string& name, const char* words, const std::string& weights, const std::string& path) {
    Result<Vocabulary> vocabulary = open_vocabulary(words, path);
    if (!vocabulary) throw std::runtime_error(vocabulary.error().message);
    return DescriptorKind{name, weights, *std::move(vocabulary)};
  };
  std::vector<DescriptorKind> kinds = {kind("raw", kRawDescriptors, "", ""),
                                       kind("boosted", kBoostedDescriptors, BoosterOptions{}.weights, "")};
  for (const std::string& files : arguments.boosted) {
    const std::size_t comma = std::min(files.find(','), files.size() - 1);
    kinds.push_back(kind(files, kBoostedDescriptors, files.substr(0, comma), files.substr(comma + 1)));
  }
  return kinds;
}

/// Of each kind, the thresholds that ship and those of --try.
std::vector<Setting> settings_of(const Arguments& arguments, const std::vector<DescriptorKind>& kinds) {
  std::vector<Setting> settings;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    settings.push_back({kinds[k].name, k, kinds[k].is_boosted() ? for_boosted({}) : PlaceVerifierOptions{}});
    for (const std::string& text : arguments.settings) {
      PlaceVerifierOptions o;
      if (std::sscanf(text.c_str(), "%d,%d,%lf", &o.max_distance_bit, &o.min_inliers, &o.min_visible_share) != 3)
        throw std::runtime_error(text + ": not BITS,INLIERS,SHARE");
      settings.push_back({kinds[k].name, k, o});
    }
  }
  return settings;
}

void run(const Arguments& arguments) {
  const std::vector<DescriptorKind> kinds = kinds_of(arguments);
  const std::vector<Setting> settings = settings_of(arguments, kinds);
  std::vector<SeenRoom> rooms(static_cast<std::size_t>(arguments.rooms));
  in_parallel(arguments.threads, rooms.size(),
              [&](std::size_t i) { rooms[i] = look_at_room(arguments.seed + static_cast<int>(i), i, arguments.samples, kinds); });
  fmt::print("{} rooms from seed {}\n", arguments.rooms, arguments.seed);
  std::FILE* file = arguments.accepted.empty() ? nullptr : std::fopen(arguments.accepted.c_str(), "w");
  for (const Setting& setting : settings) {
    const Table table = measure(arguments.threads, rooms, setting, kinds[setting.kind]);
    print(setting, table);
    if (file != nullptr) write_accepted(file, setting, table);
  }
  if (file != nullptr) std::fclose(file);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Places known again after a change of light, furniture and viewpoint, with raw and boosted descriptors.");
  Arguments arguments;
  app.add_option("--rooms", arguments.rooms)->check(CLI::PositiveNumber);
  app.add_option("--seed", arguments.seed, "of the first room");
  app.add_option("--threads", arguments.threads)->check(CLI::PositiveNumber);
  app.add_option("--samples", arguments.samples, "rays per pixel")->check(CLI::PositiveNumber);
  app.add_option("--boosted", arguments.boosted, "WEIGHTS,VOCABULARY: another boosted kind");
  app.add_option("--try", arguments.settings, "BITS,INLIERS,SHARE: other thresholds");
  app.add_option("--accepted", arguments.accepted, "file for every accepted pair with its inliers and errors");
  CLI11_PARSE(app, argc, argv);
  try {
    run(arguments);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
  return 0;
}
