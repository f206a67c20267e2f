// SPDX-License-Identifier: Apache-2.0
// Plan of an experiment: recordings x frontends x configurations x repetitions, from a small YAML file. Pure except for
// checking whether recordings exist; any thread.
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

/// A recording to be rendered by `fbvins simulate`.
struct RenderSpec {
  std::string preset = "normal";
  std::string trajectory, imu;  ///< files of a recorded flight, relative to --inputs; empty: synthetic
  double seconds = 0;           ///< 0: the preset's, or the whole recorded flight
  std::vector<std::string> settings;
};

struct DatasetSpec {
  std::string name;   ///< of the group: its seeds share a row in tables
  std::string euroc;  ///< name of a folder or zip in --euroc; if it exists it is used instead of rendering
  std::string path;   ///< of a recording; empty if it is rendered
  std::optional<RenderSpec> rendered;
  std::vector<int> seeds{1};  ///< of the rendering
};

struct ConfigurationSpec {
  std::string name = "default";
  std::string file;                   ///< YAML for fbvins run --config, relative to the matrix
  std::vector<std::string> settings;  ///< for --set
};

struct Matrix {
  std::string title;
  std::vector<DatasetSpec> datasets;
  std::vector<std::string> frontends;
  std::vector<ConfigurationSpec> configurations;
  int repetitions = 1;
};

/// Unknown keys, wrong types and an empty matrix are errors with a line number.
Result<Matrix> parse_matrix(const std::string& text, const std::string& source);
Result<Matrix> read_matrix(const std::string& path);

struct Recording {
  std::string id;       ///< name of a folder
  std::string dataset;  ///< the group
  std::string path;     ///< existing or to be rendered
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
  std::vector<Cell> cells;  ///< in order of recordings
};

struct PlanOptions {
  std::string euroc = "";     ///< folder with the user's own recordings
  std::string inputs = "";    ///< `trajectory` and `imu` are relative to this folder
  std::string rendered = "";  ///< folder for rendered recordings
};

/// Lists recordings and cells. An error for a recording that neither exists nor can be rendered, or duplicate names.
Result<Plan> make_plan(const Matrix& matrix, const PlanOptions& options);

}  // namespace fbvins
