// SPDX-License-Identifier: Apache-2.0
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <ctime>
#include <memory>
#include <set>

#include "apps/commands.hpp"
#include "apps/map_edit_commands.hpp"
#include "apps/terminal.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/map_journal.hpp"
#include "fbvins/loop/map_merge.hpp"
#include "fbvins/loop/map_sessions.hpp"
#include "fbvins/loop/vocabulary_file.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples = R"(examples:
  fbvins map info flat.fbm                       what is in a map
  fbvins map merge monday.fbm tuesday.fbm -o flat.fbm
  fbvins map export flat.fbm --ply points.ply --tum keyframes.txt
  fbvins map cut flat.fbm --box 0,0,-1,8,5,3 -o kitchen.fbm
  fbvins map align flat.fbm -o building.fbm --points 0.2,0.1,0,12,4,0  5.3,0.2,0,12,9,0  5.1,3.9,1,8,9,1
  fbvins map rename flat.fbm "Second floor"
  fbvins map diff monday.fbm tuesday.fbm
  fbvins map forget flat.fbm --session 3 -o before.fbm      as if that session had not been flown
)";

struct Arguments {
  std::string file, output, ply, tum, vocabulary;
  std::vector<std::string> files;
  bool leave_out = false;
};

/// Where the sensors' clock counts from 1970, as most do: the date, UTC.
std::string when(Time t) {
  constexpr std::int64_t k2000_s = 946'684'800, kNs = 1'000'000'000;
  if (t.ns / kNs < k2000_s) return fmt::format("at {:.1f} s of its clock", t.seconds());
  const std::time_t seconds = static_cast<std::time_t>(t.ns / kNs);
  return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(seconds));
}

void print_sessions(const PlaceMap& map) {
  for (const SessionInMap& s : sessions_in(map))
    fmt::print("session {}: {}, {:.0f} s, {} keyframes, {} of them still here, {} loops with other sessions\n", s.known.number,
               when(s.known.began), (s.known.ended - s.known.began).seconds(), s.known.keyframes, s.keyframes,
               std::max(s.known.loops, s.loops));
}

int info(const Arguments& arguments) {
  const auto map = load_map(arguments.file);
  if (!map) return fail(map.error().message);
  std::size_t features = 0, points = 0;
  Vec3 low = Vec3::Constant(1e9), high = Vec3::Constant(-1e9);
  for (const MapKeyframe& k : map->keyframes()) {
    features += k.place.size();
    points += static_cast<std::size_t>(
        std::count_if(k.place.features.begin(), k.place.features.end(), [](const PlaceFeature& f) { return f.has_point(); }));
    low = low.cwiseMin(k.T_MB.p), high = high.cwiseMax(k.T_MB.p);
  }
  const auto loops =
      std::count_if(map->edges.begin(), map->edges.end(), [](const MapEdge& e) { return e.kind == MapEdge::Kind::loop; });
  fmt::print("{}: {} keyframes of {} sessions, {} loops, {} {}features, {} with depth\n", arguments.file, map->size(),
             map->sessions.size(), loops, features, map->boosted ? "boosted " : "", points);
  if (const std::size_t in_file = map->base ? map->base->keyframes.size() : 0; map->size() > in_file)
    fmt::print("{} of the keyframes are in {}, of a flight that has not ended\n", map->size() - in_file,
               journal_of(arguments.file));
  if (!map->name.empty()) fmt::print("name: {}\n", map->name);
  if (map->anchored) fmt::print("in the frame of a building, by {} anchors\n", map->anchors.size());
  std::set<int> tags;
  for (const MapTag& t : map->tags) tags.insert(t.id);
  if (!tags.empty()) fmt::print("tags that tie its flights: {}\n", fmt::join(tags, ", "));
  if (!map->empty())
    fmt::print("keyframes span {:.1f} x {:.1f} x {:.1f} m\n", high.x() - low.x(), high.y() - low.y(), high.z() - low.z());
  print_sessions(*map);
  return kOk;
}

int merge(const Arguments& arguments) {
  std::vector<PlaceMap> maps;
  for (const std::string& file : arguments.files) {
    auto map = load_map(file);
    if (!map) return fail(map.error().message);
    maps.push_back(*std::move(map));
  }
  const auto vocabulary = open_vocabulary(maps[0].boosted ? kBoostedDescriptors : kRawDescriptors, arguments.vocabulary);
  if (!vocabulary) return fail(vocabulary.error().message);
  const MergedMaps merged = merge_all(std::move(maps), {}, *vocabulary);
  for (const LeftOutMap& other : merged.left_out) {
    const std::string why = fmt::format("{}: {}", arguments.files[other.index], other.why);
    if (!arguments.leave_out) return fail(why);
    warn(why + "; it is left out");
  }
  if (merged.left_out.size() + 1 == arguments.files.size()) return kNothingJoined;
  if (auto saved = save_map(merged.map, arguments.output); !saved) return fail(saved.error().message);
  fmt::print("{}: {} keyframes\n", arguments.output, merged.map.size());
  return kOk;
}

int write(const std::string& path, const std::string& text) {
  if (auto written = write_file_atomically(path, text); !written) return fail(written.error().message);
  fmt::print("{}\n", path);
  return kOk;
}

int export_files(const Arguments& arguments) {
  if (arguments.ply.empty() && arguments.tum.empty()) return fail("no output file: give --ply FILE or --tum FILE");
  const auto map = load_map(arguments.file);
  if (!map) return fail(map.error().message);
  int code = kOk;
  if (!arguments.ply.empty()) code = write(arguments.ply, map_as_ply(*map));
  if (code == kOk && !arguments.tum.empty()) code = write(arguments.tum, map_as_tum(*map));
  return code;
}

}  // namespace

void add_map_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("map", kMapDescription);
  command->footer(kExamples);
  command->require_subcommand(1);
  CLI::App* looking = command->add_subcommand("info", "what is in a map");
  looking->add_option("map", arguments->file, "map file")->required();
  looking->callback([arguments, &exit_code] { exit_code = info(*arguments); });
  CLI::App* joining = command->add_subcommand("merge", "join maps in the frame of the first");
  joining->add_option("maps", arguments->files, "map files")->required()->expected(2, 1000);
  joining->add_option("-o,--output", arguments->output, "the file to write")->required();
  joining->add_flag("--leave-out", arguments->leave_out,
                    "maps that have no place in common with the others are left out, instead of being an error");
  joining->add_option("--vocabulary", arguments->vocabulary, "vocabulary file, instead of the one that ships");
  joining->callback([arguments, &exit_code] { exit_code = merge(*arguments); });
  CLI::App* exporting = command->add_subcommand("export", "points as PLY, keyframes as TUM");
  exporting->add_option("map", arguments->file, "map file")->required();
  exporting->add_option("--ply", arguments->ply, "point cloud to write");
  exporting->add_option("--tum", arguments->tum, "trajectory of the keyframes to write");
  exporting->callback([arguments, &exit_code] { exit_code = export_files(*arguments); });
  add_map_edits(*command, exit_code);
}

}  // namespace fbvins::app
