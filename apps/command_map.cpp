// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <set>

#include "apps/commands.hpp"
#include "apps/map_edit_commands.hpp"
#include "apps/terminal.hpp"
#include "fbvins/io/output_file.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/map_merge.hpp"
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
)";

struct Arguments {
  std::string file, output, ply, tum, vocabulary;
  std::vector<std::string> files;
};

int info(const Arguments& arguments) {
  const auto map = load_map(arguments.file);
  if (!map) return fail(map.error().message);
  std::size_t features = 0, points = 0;
  std::set<std::uint32_t> flights;
  Vec3 low = Vec3::Constant(1e9), high = Vec3::Constant(-1e9);
  for (const MapKeyframe& k : map->keyframes()) {
    features += k.place.size();
    points += static_cast<std::size_t>(
        std::count_if(k.place.features.begin(), k.place.features.end(), [](const PlaceFeature& f) { return f.has_point(); }));
    flights.insert(k.session);
    low = low.cwiseMin(k.T_MB.p), high = high.cwiseMax(k.T_MB.p);
  }
  const auto loops =
      std::count_if(map->edges.begin(), map->edges.end(), [](const MapEdge& e) { return e.kind == MapEdge::Kind::loop; });
  fmt::print("{}: {} keyframes of {} flights, {} loops, {} {}features, {} with depth\n", arguments.file, map->size(),
             flights.size(), loops, features, map->boosted ? "boosted " : "", points);
  if (!map->name.empty()) fmt::print("name: {}\n", map->name);
  if (map->anchored) fmt::print("in the frame of a building, by {} anchors\n", map->anchors.size());
  if (!map->empty())
    fmt::print("keyframes span {:.1f} x {:.1f} x {:.1f} m\n", high.x() - low.x(), high.y() - low.y(), high.z() - low.z());
  return kOk;
}

int merge(const Arguments& arguments) {
  auto all = load_map(arguments.files[0]);
  if (!all) return fail(all.error().message);
  const auto vocabulary = open_vocabulary(all->boosted ? kBoostedDescriptors : kRawDescriptors, arguments.vocabulary);
  if (!vocabulary) return fail(vocabulary.error().message);
  for (std::size_t i = 1; i < arguments.files.size(); ++i) {
    const auto next = load_map(arguments.files[i]);
    if (!next) return fail(next.error().message);
    all = merge_maps(std::move(*all), *next, {}, *vocabulary);
    if (!all) return fail(fmt::format("{}: {}", arguments.files[i], all.error().message));
  }
  if (auto saved = save_map(*all, arguments.output); !saved) return fail(saved.error().message);
  fmt::print("{}: {} keyframes\n", arguments.output, all->size());
  return kOk;
}

int write_text(const std::string& path, const std::string& text) {
  auto file = OutputFile::create(path);
  if (!file) return fail(file.error().message);
  file->write(text);
  if (auto closed = file->close(); !closed) return fail(closed.error().message);
  fmt::print("{}\n", path);
  return kOk;
}

int export_files(const Arguments& arguments) {
  if (arguments.ply.empty() && arguments.tum.empty()) return fail("no output file: give --ply FILE or --tum FILE");
  const auto map = load_map(arguments.file);
  if (!map) return fail(map.error().message);
  int code = kOk;
  if (!arguments.ply.empty()) code = write_text(arguments.ply, map_as_ply(*map));
  if (code == kOk && !arguments.tum.empty()) code = write_text(arguments.tum, map_as_tum(*map));
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
