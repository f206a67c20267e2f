// SPDX-License-Identifier: Apache-2.0
// What an experiment is made of: recordings x frontends x configurations x repetitions, from a small YAML file.
// Pure but for looking whether recordings exist; any thread.
//
//   Result<Matrix> matrix = read_matrix("configs/scenarios.yaml");
//   Result<Plan> plan = make_plan(*matrix, {.rendered = "bench/rendered"});
//   for (const Cell& cell : plan->cells) run(cell);
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"

namespace fbvins {

/// A flight for `fbvins simulate` to render.
struct RenderSpec {
  std::string preset = "normal";
  std::string trajectory, imu;  ///< of a recorded flight, below --inputs; empty: a synthetic one
  double seconds = 0;           ///< 0: the preset's, or the whole recorded flight
  std::vector<std::string> settings;
};

struct DatasetSpec {
  std::string name;   ///< of the group: its seeds belong together in tables
  std::string euroc;  ///< name of a folder or zip below --euroc, taken instead of rendering where it is there
  std::string path;   ///< of a recording; empty where it is rendered
  std::optional<RenderSpec> rendered;
  std::vector<int> seeds{1};  ///< of the rendering
};

struct ConfigurationSpec {
  std::string name = "default";
  std::string file;                   ///< YAML for fbvins run --config, beside the matrix
  std::vector<std::string> settings;  ///< for --set
};

struct Matrix {
  std::string title;
  std::vector<DatasetSpec> datasets;
  std::vector<std::string> frontends;
  std::vector<ConfigurationSpec> configurations;
  int repetitions = 1;
};

/// Unknown key, wrong type or nothing to do: an error with the line.
Result<Matrix> parse_matrix(const std::string& text, const std::string& source);
Result<Matrix> read_matrix(const std::string& path);

struct Recording {
  std::string id;       ///< name of a folder
  std::string dataset;  ///< the group
  std::string path;     ///< where it is, or will be once rendered
  int seed = 0;         ///< of the rendering; 0 for a real one
  std::optional<RenderSpec> rendered;
};

struct Cell {
  std::string id;  ///< name of a folder
  std::size_t recording = 0;
  std::string frontend;
  ConfigurationSpec configuration;
  int repetition = 1;
};

struct Plan {
  std::vector<Recording> recordings;
  std::vector<Cell> cells;  ///< those of a recording together
};

struct PlanOptions {
  std::string euroc = "";     ///< folder with the user's own recordings
  std::string inputs = "";    ///< folder that `trajectory` and `imu` are relative to
  std::string rendered = "";  ///< folder for what is rendered
};

/// Which recordings and cells there are.
Result<Plan> make_plan(const Matrix& matrix, const PlanOptions& options);

}  // namespace fbvins
