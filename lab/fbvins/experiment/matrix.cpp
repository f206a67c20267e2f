// SPDX-License-Identifier: Apache-2.0
#include "fbvins/experiment/matrix.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "fbvins/frontend/frontend_options.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/yaml_reader.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;
constexpr int kMostSeeds = 100'000;

/// `seeds: 20` means 1 to 20; a list gives them one by one.
std::vector<int> seeds_of(YamlReader& yaml, const YAML::Node& map) {
  std::vector<int> seeds;
  if (yaml.get(map, "seeds").IsDefined() && yaml.get(map, "seeds").IsScalar()) {
    const int count = static_cast<int>(yaml.number_between(map, "seeds", 1, kMostSeeds, 1));
    for (int s = 1; s <= count; ++s) seeds.push_back(s);
    return seeds;
  }
  for (const std::string& text : yaml.texts(map, "seeds")) {
    int seed = -1;
    if (!YAML::convert<int>::decode(YAML::Node(text), seed) || seed < 0)
      yaml.complain(yaml.get(map, "seeds"), "a seed is a whole number");
    seeds.push_back(seed);
  }
  return seeds.empty() ? std::vector<int>{1} : seeds;
}

std::string default_name(const RenderSpec& rendered) {
  return rendered.seconds > 0 ? fmt::format("{}-{:g}s", rendered.preset, rendered.seconds) : rendered.preset;
}

/// An entry may have several presets: each becomes a dataset.
void read_dataset(YamlReader& yaml, const YAML::Node& node, Matrix& matrix) {
  yaml.only(node, {"name", "euroc", "path", "simulate"});
  if (!yaml.ok()) return;
  DatasetSpec spec;
  spec.name = yaml.text(node, "name");
  spec.euroc = yaml.text(node, "euroc");
  spec.path = yaml.text(node, "path");
  const YAML::Node simulate = yaml.get(node, "simulate");
  if (!simulate.IsDefined()) {
    if (spec.euroc.empty() && spec.path.empty()) return yaml.complain(node, "a dataset needs euroc, path or simulate");
    if (spec.name.empty()) spec.name = spec.euroc.empty() ? fs::path(spec.path).stem().string() : spec.euroc;
    matrix.datasets.push_back(std::move(spec));
    return;
  }
  yaml.only(simulate, {"preset", "trajectory", "imu", "seconds", "seeds", "set"});
  if (!yaml.ok()) return;
  RenderSpec rendered;
  rendered.trajectory = yaml.text(simulate, "trajectory");
  rendered.imu = yaml.text(simulate, "imu");
  rendered.seconds = yaml.number_between(simulate, "seconds", 1, 86'400, 0);
  rendered.settings = yaml.texts(simulate, "set");
  spec.seeds = seeds_of(yaml, simulate);
  std::vector<std::string> presets = yaml.texts(simulate, "preset");
  if (presets.empty()) presets.emplace_back("normal");
  if (presets.size() > 1 && !spec.name.empty())
    return yaml.complain(yaml.get(node, "name"), "several presets cannot share one name");
  for (const std::string& preset : presets) {
    DatasetSpec one = spec;
    rendered.preset = preset;
    if (one.name.empty()) one.name = default_name(rendered);
    one.rendered = rendered;
    matrix.datasets.push_back(std::move(one));
  }
}

ConfigurationSpec read_configuration(YamlReader& yaml, const YAML::Node& node) {
  yaml.only(node, {"name", "config", "set"});
  if (!yaml.ok()) return {};
  ConfigurationSpec spec{yaml.text(node, "name"), yaml.text(node, "config"), yaml.texts(node, "set")};
  if (spec.name.empty()) yaml.complain(node, "a configuration needs a name");
  return spec;
}

/// Replaces characters that are not allowed in names of folders.
std::string folder_name(std::string text) {
  for (char& c : text)
    if (!(std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' || c == '.')) c = '_';
  return text;
}

std::string below(const std::string& folder, const std::string& path) {
  return path.empty() || folder.empty() || fs::path(path).is_absolute() ? path : (fs::path(folder) / path).string();
}

/// Path of the user's own recording, if it exists.
std::string real_recording(const DatasetSpec& spec, const PlanOptions& options) {
  if (!spec.path.empty()) return spec.path;
  if (spec.euroc.empty() || options.euroc.empty()) return "";
  for (const char* ending : {"", ".zip"})
    if (std::string path = below(options.euroc, fmt::format("{}{}", spec.euroc, ending)); fs::exists(path)) return path;
  return "";
}

}  // namespace

Result<Matrix> parse_matrix(const std::string& text, const std::string& source) {
  YamlReader yaml(source, text, YamlReader::Root::anything);
  if (!yaml.ok()) return yaml.error();
  const YAML::Node& root = yaml.root();
  Matrix matrix;
  yaml.only(root, {"title", "datasets", "frontends", "configurations", "repetitions"});
  if (!yaml.ok()) return yaml.error();
  matrix.title = yaml.text(root, "title");
  matrix.frontends = yaml.texts(root, "frontends");
  const std::vector<std::string> known = frontend_names();
  for (const std::string& name : matrix.frontends)
    if (std::find(known.begin(), known.end(), name) == known.end())
      yaml.complain(yaml.get(root, "frontends"),
                    fmt::format("there is no frontend '{}'; there are {}", name, fmt::join(known, ", ")));
  if (matrix.frontends.empty()) matrix.frontends.push_back(default_frontend());
  matrix.repetitions = static_cast<int>(yaml.number_between(root, "repetitions", 1, 1000, 1));
  const YAML::Node datasets = yaml.get(root, "datasets"), configurations = yaml.get(root, "configurations");
  if (!datasets.IsDefined() || !datasets.IsSequence() || datasets.size() == 0) yaml.complain(root, "a list 'datasets' is needed");
  else
    for (const YAML::Node& node : datasets) read_dataset(yaml, node, matrix);
  if (configurations.IsDefined())
    for (const YAML::Node& node : configurations) matrix.configurations.push_back(read_configuration(yaml, node));
  if (matrix.configurations.empty()) matrix.configurations.emplace_back();
  if (!yaml.ok()) return yaml.error();
  return matrix;
}

Result<Matrix> read_matrix(const std::string& path) {
  Result<std::string> text = read_file(path, 1u << 20u);
  if (!text) return text.error();
  Result<Matrix> matrix = parse_matrix(*text, path);
  if (!matrix) return matrix;
  const std::string folder = fs::path(path).parent_path().string();
  for (ConfigurationSpec& c : matrix->configurations) c.file = below(folder, c.file);
  if (matrix->title.empty()) matrix->title = fs::path(path).stem().string();
  return matrix;
}

Result<Plan> make_plan(const Matrix& matrix, const PlanOptions& options) {
  Plan plan;
  std::set<std::string> ids;
  for (const DatasetSpec& spec : matrix.datasets) {
    Recording recording;
    recording.dataset = spec.name;
    recording.path = real_recording(spec, options);
    if (!recording.path.empty()) {
      recording.id = folder_name(spec.name);
      plan.recordings.push_back(recording);
    } else if (!spec.rendered) {
      return Error{ErrorCode::not_found, fmt::format("{}: give the folder that holds it with --euroc", spec.name)};
    } else {
      for (int seed : spec.seeds) {
        recording.seed = seed;
        recording.id = folder_name(spec.seeds.size() > 1 || seed != 1 ? fmt::format("{}-s{}", spec.name, seed) : spec.name);
        recording.path = below(options.rendered, recording.id);
        recording.rendered = spec.rendered;
        recording.rendered->trajectory = below(options.inputs, spec.rendered->trajectory);
        recording.rendered->imu = below(options.inputs, spec.rendered->imu);
        plan.recordings.push_back(recording);
      }
    }
  }
  for (std::size_t r = 0; r < plan.recordings.size(); ++r) {
    if (!ids.insert(plan.recordings[r].id).second)
      return Error{ErrorCode::invalid_argument, fmt::format("two datasets are called {}", plan.recordings[r].id)};
    for (const std::string& frontend : matrix.frontends)
      for (const ConfigurationSpec& configuration : matrix.configurations)
        for (int k = 1; k <= matrix.repetitions; ++k) {
          std::string id = fmt::format("{}-{}", plan.recordings[r].id, folder_name(frontend));
          if (matrix.configurations.size() > 1) id += fmt::format("-{}", folder_name(configuration.name));
          if (matrix.repetitions > 1) id += fmt::format("-r{}", k);
          plan.cells.push_back({id, r, frontend, configuration, k});
        }
  }
  return plan;
}

}  // namespace fbvins
