// SPDX-License-Identifier: Apache-2.0
#include "fbvins/experiment/matrix.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <set>

#include "fbvins/frontend/frontend_options.hpp"
#include "fbvins/io/file_source.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;
constexpr int kMostSeeds = 100'000;

/// Reads and keeps the first complaint.
class Reader {
 public:
  explicit Reader(std::string source) : source_(std::move(source)) {}

  const std::string& problem() const { return problem_; }
  void complain(const YAML::Node& at, const std::string& sentence) {
    if (problem_.empty()) problem_ = fmt::format("{}:{}: {}", source_, at.Mark().line + 1, sentence);
  }
  void only(const YAML::Node& map, std::initializer_list<const char*> known) {
    if (!map.IsMap()) return complain(map, "names and values are wanted here");
    for (const auto& entry : map) {
      const std::string name = entry.first.Scalar();
      if (std::find(known.begin(), known.end(), name) != known.end()) continue;
      std::string list;
      for (const char* k : known) list += fmt::format("{}{}", list.empty() ? "" : ", ", k);
      complain(entry.first, fmt::format("unknown key '{}'; known here: {}", name, list));
    }
  }
  std::string text(const YAML::Node& map, const char* key) {
    const YAML::Node node = map[key];
    if (!node) return "";
    if (!node.IsScalar()) complain(node, fmt::format("'{}' wants one value", key));
    return node.IsScalar() ? node.Scalar() : "";
  }
  /// One value is a list of one.
  std::vector<std::string> texts(const YAML::Node& map, const char* key) {
    std::vector<std::string> out;
    const YAML::Node node = map[key];
    if (!node) return out;
    if (node.IsScalar()) return {node.Scalar()};
    if (!node.IsSequence()) complain(node, fmt::format("'{}' wants a list", key));
    else
      for (const YAML::Node& item : node) {
        if (!item.IsScalar()) complain(item, fmt::format("'{}' wants a list of plain values", key));
        else out.push_back(item.Scalar());
      }
    return out;
  }
  double number(const YAML::Node& map, const char* key, double low, double high, double otherwise) {
    const YAML::Node node = map[key];
    if (!node) return otherwise;
    double value = 0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !(value >= low && value <= high))
      complain(node, fmt::format("'{}' wants a number from {} to {}", key, low, high));
    return value;
  }

 private:
  std::string source_, problem_;
};

/// `seeds: 20` are 1 to 20; a list names them.
std::vector<int> seeds_of(Reader& reader, const YAML::Node& map) {
  std::vector<int> seeds;
  if (map["seeds"] && map["seeds"].IsScalar()) {
    const int count = static_cast<int>(reader.number(map, "seeds", 1, kMostSeeds, 1));
    for (int s = 1; s <= count; ++s) seeds.push_back(s);
    return seeds;
  }
  for (const std::string& text : reader.texts(map, "seeds")) {
    int seed = -1;
    if (!YAML::convert<int>::decode(YAML::Node(text), seed) || seed < 0)
      reader.complain(map["seeds"], "a seed is a whole number");
    seeds.push_back(seed);
  }
  return seeds.empty() ? std::vector<int>{1} : seeds;
}

std::string default_name(const DrawnSpec& drawn) {
  return drawn.seconds > 0 ? fmt::format("{}-{:g}s", drawn.preset, drawn.seconds) : drawn.preset;
}

/// One entry may stand for several presets.
void read_dataset(Reader& reader, const YAML::Node& node, Matrix& matrix) {
  reader.only(node, {"name", "euroc", "path", "simulate"});
  if (!reader.problem().empty()) return;
  DatasetSpec spec;
  spec.name = reader.text(node, "name");
  spec.euroc = reader.text(node, "euroc");
  spec.path = reader.text(node, "path");
  const YAML::Node simulate = node["simulate"];
  if (!simulate) {
    if (spec.euroc.empty() && spec.path.empty()) return reader.complain(node, "a dataset needs euroc, path or simulate");
    if (spec.name.empty()) spec.name = spec.euroc.empty() ? fs::path(spec.path).stem().string() : spec.euroc;
    matrix.datasets.push_back(std::move(spec));
    return;
  }
  reader.only(simulate, {"preset", "trajectory", "imu", "seconds", "seeds", "set"});
  if (!reader.problem().empty()) return;
  DrawnSpec drawn;
  drawn.trajectory = reader.text(simulate, "trajectory");
  drawn.imu = reader.text(simulate, "imu");
  drawn.seconds = reader.number(simulate, "seconds", 1, 86'400, 0);
  drawn.settings = reader.texts(simulate, "set");
  spec.seeds = seeds_of(reader, simulate);
  std::vector<std::string> presets = reader.texts(simulate, "preset");
  if (presets.empty()) presets.emplace_back("normal");
  if (presets.size() > 1 && !spec.name.empty()) return reader.complain(node["name"], "several presets cannot share one name");
  for (const std::string& preset : presets) {
    DatasetSpec one = spec;
    drawn.preset = preset;
    if (one.name.empty()) one.name = default_name(drawn);
    one.drawn = drawn;
    matrix.datasets.push_back(std::move(one));
  }
}

ConfigurationSpec read_configuration(Reader& reader, const YAML::Node& node) {
  reader.only(node, {"name", "config", "set"});
  if (!reader.problem().empty()) return {};
  ConfigurationSpec spec{reader.text(node, "name"), reader.text(node, "config"), reader.texts(node, "set")};
  if (spec.name.empty()) reader.complain(node, "a configuration needs a name");
  return spec;
}

/// What may stand in the name of a folder.
std::string folder_name(std::string text) {
  for (char& c : text)
    if (!(std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' || c == '.')) c = '_';
  return text;
}

std::string below(const std::string& folder, const std::string& path) {
  return path.empty() || folder.empty() || fs::path(path).is_absolute() ? path : (fs::path(folder) / path).string();
}

/// The user's own recording, if it is there.
std::string real_recording(const DatasetSpec& spec, const PlanOptions& options) {
  if (!spec.path.empty()) return spec.path;
  if (spec.euroc.empty() || options.euroc.empty()) return "";
  for (const char* ending : {"", ".zip"})
    if (std::string path = below(options.euroc, fmt::format("{}{}", spec.euroc, ending)); fs::exists(path)) return path;
  return "";
}

}  // namespace

Result<Matrix> parse_matrix(const std::string& text, const std::string& source) {
  Reader reader(source);
  Matrix matrix;
  YAML::Node root;
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    return Error{ErrorCode::malformed, fmt::format("{}:{}: {}", source, error.mark.line + 1, error.msg)};
  }
  reader.only(root, {"title", "datasets", "frontends", "configurations", "repetitions"});
  if (!reader.problem().empty()) return Error{ErrorCode::malformed, reader.problem()};
  matrix.title = reader.text(root, "title");
  matrix.frontends = reader.texts(root, "frontends");
  const std::vector<std::string> known = frontend_names();
  for (const std::string& name : matrix.frontends)
    if (std::find(known.begin(), known.end(), name) == known.end())
      reader.complain(root["frontends"], fmt::format("there is no frontend '{}'; there are {}", name, fmt::join(known, ", ")));
  if (matrix.frontends.empty()) matrix.frontends.push_back(known.front());
  matrix.repetitions = static_cast<int>(reader.number(root, "repetitions", 1, 1000, 1));
  const YAML::Node datasets = root["datasets"], configurations = root["configurations"];
  if (!datasets || !datasets.IsSequence() || datasets.size() == 0) reader.complain(root, "a list 'datasets' is needed");
  else
    for (const YAML::Node& node : datasets) read_dataset(reader, node, matrix);
  if (configurations)
    for (const YAML::Node& node : configurations) matrix.configurations.push_back(read_configuration(reader, node));
  if (matrix.configurations.empty()) matrix.configurations.emplace_back();
  if (!reader.problem().empty()) return Error{ErrorCode::malformed, reader.problem()};
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
    } else if (!spec.drawn) {
      return Error{ErrorCode::not_found, fmt::format("{}: give the folder that holds it with --euroc", spec.name)};
    } else {
      for (int seed : spec.seeds) {
        recording.seed = seed;
        recording.id = folder_name(spec.seeds.size() > 1 || seed != 1 ? fmt::format("{}-s{}", spec.name, seed) : spec.name);
        recording.path = below(options.drawn, recording.id);
        recording.drawn = spec.drawn;
        recording.drawn->trajectory = below(options.inputs, spec.drawn->trajectory);
        recording.drawn->imu = below(options.inputs, spec.drawn->imu);
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
