// SPDX-License-Identifier: Apache-2.0
#include "apps/map_edit_commands.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>

#include "apps/commands.hpp"
#include "apps/evaluation_report.hpp"
#include "apps/terminal.hpp"
#include "fbvins/core/angle.hpp"
#include "fbvins/io/quoted.hpp"
#include "fbvins/loop/map_edit.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/map_sessions.hpp"

namespace fbvins::app {
namespace {

struct Edit {
  std::string file, output, name;
  std::vector<double> box, points;
  std::vector<std::uint32_t> sessions;
  bool remove_inside = false;
};

int save(const PlaceMap& map, const std::string& path) {
  if (const auto saved = save_map(map, path); !saved) return fail(saved.error().message);
  fmt::print("{}: {} keyframes\n", path, map.size());
  return kOk;
}

int cut(const Edit& edit) {
  auto map = load_map(edit.file);
  if (!map) return fail(map.error().message);
  const Vec3 a(edit.box[0], edit.box[1], edit.box[2]), b(edit.box[3], edit.box[4], edit.box[5]);
  const std::size_t before = map->size();
  const PlaceMap part = cut_map(*std::move(map), {a.cwiseMin(b), a.cwiseMax(b)}, edit.remove_inside);
  if (part.empty()) return fail(fmt::format("{}: none of its {} keyframes would be left", edit.file, before));
  return save(part, edit.output);
}

int forget(const Edit& edit) {
  auto map = load_map(edit.file);
  if (!map) return fail(map.error().message);
  const auto rest = without_sessions(*std::move(map), {edit.sessions.begin(), edit.sessions.end()});
  if (!rest) return fail(fmt::format("{}: {}", edit.file, rest.error().message));
  return save(*rest, edit.output);
}

int rename(const Edit& edit) {
  auto map = load_map(edit.file);
  if (!map) return fail(map.error().message);
  map->name = printable(edit.name);
  return save(*map, edit.output.empty() ? edit.file : edit.output);
}

/// To so many decimals, and never minus zero.
double rounded(double value, int decimals) {
  const double unit = std::pow(10, decimals);
  return std::round(value * unit) / unit + 0.0;
}

int align(const Edit& edit) {
  constexpr std::size_t kNumbers = 6;  // of a point
  if (edit.points.size() % kNumbers != 0)
    return fail("--points: six numbers each are needed: x,y,z in the map and in the building");
  auto map = load_map(edit.file);
  if (!map) return fail(map.error().message);
  std::vector<SurveyedPoint> points;
  for (std::size_t i = 0; i < edit.points.size(); i += kNumbers) {
    const double* n = edit.points.data() + i;
    points.push_back({{n[0], n[1], n[2]}, {n[3], n[4], n[5]}});
  }
  const auto done = align_map(*map, points);
  if (!done) return fail(fmt::format("{}: {}", edit.file, done.error().message));
  fmt::print("turned by {:.2f} degrees, moved by {:.3f}, {:.3f}, {:.3f} m; the points fit to {:.3f} m\n",
             rounded(done->heading_rad / kDegree, 2), rounded(done->moved_m.x(), 3), rounded(done->moved_m.y(), 3),
             rounded(done->moved_m.z(), 3), done->rms_m);
  return save(*map, edit.output);
}

int compare(const std::vector<std::string>& files, bool json) {
  const auto first = load_map(files[0]), second = load_map(files[1]);
  if (!first) return fail(first.error().message);
  if (!second) return fail(second.error().message);
  const MapDifference d = compare_maps(*first, *second);
  if (json) {
    fmt::print("{}\n", Json{{"keyframes_in_both", d.in_both},
                            {"keyframes_only_in_first", d.only_first},
                            {"keyframes_only_in_second", d.only_second},
                            {"loops", {d.loops_first, d.loops_second}},
                            {"moved_rms_m", d.rms_m},
                            {"moved_largest_m", d.largest_m},
                            {"turned_largest_deg", d.largest_deg}}
                           .dump(2));
    return kOk;
  }
  fmt::print("keyframes: {} in both, {} only in {}, {} only in {}\n", d.in_both, d.only_first, files[0], d.only_second, files[1]);
  fmt::print("loops: {} and {}\n", d.loops_first, d.loops_second);
  if (d.in_both > 0)
    fmt::print("those in both differ by {:.4f} m (RMS), at most {:.4f} m and {:.3f} degrees\n", d.rms_m, d.largest_m,
               d.largest_deg);
  return kOk;
}

}  // namespace

void add_map_edits(CLI::App& map, int& exit_code) {
  auto edit = std::make_shared<Edit>();
  auto files = std::make_shared<std::vector<std::string>>();
  auto json = std::make_shared<bool>(false);
  const auto add = [&](const char* name, const char* about, bool output_required) {
    CLI::App* command = map.add_subcommand(name, about);
    command->add_option("map", edit->file, "map file")->required();
    command
        ->add_option("-o,--output", edit->output, output_required ? "the file to write" : "the file to write (default: the same)")
        ->required(output_required);
    return command;
  };
  CLI::App* cutting = add("cut", "keep a part of a map", true);
  cutting->add_option("--box", edit->box, "two corners in the map's axes, m: X,Y,Z,X,Y,Z")
      ->delimiter(',')
      ->expected(6)
      ->required();
  cutting->add_flag("--outside", edit->remove_inside, "keep what is outside of the box");
  cutting->callback([edit, &exit_code] { exit_code = cut(*edit); });
  CLI::App* forgetting = add("forget", "take out what came with some sessions, as `info` numbers them", true);
  forgetting->add_option("--session", edit->sessions, "numbers of the sessions: N,N")->delimiter(',')->required();
  forgetting->callback([edit, &exit_code] { exit_code = forget(*edit); });
  CLI::App* naming = add("rename", "give a map a name; an empty one takes it away", false);
  naming->add_option("name", edit->name, "the name")->required();
  naming->callback([edit, &exit_code] { exit_code = rename(*edit); });
  CLI::App* aligning = add("align", "turn and move a map to a building's axes", true);
  aligning->add_option("--points", edit->points, "three or more points, x,y,z in the map and in the building, m: X,Y,Z,X,Y,Z")
      ->delimiter(',')
      ->required();
  aligning->callback([edit, &exit_code] { exit_code = align(*edit); });
  CLI::App* comparing = map.add_subcommand("diff", "how two maps differ");
  comparing->add_option("maps", *files, "map files")->required()->expected(2);
  comparing->add_flag("--json", *json, "print JSON");
  comparing->callback([files, json, &exit_code] { exit_code = compare(*files, *json); });
}

}  // namespace fbvins::app
