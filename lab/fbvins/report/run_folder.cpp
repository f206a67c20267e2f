// SPDX-License-Identifier: Apache-2.0
#include "fbvins/report/run_folder.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <filesystem>

#include "fbvins/core/text.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/io/file_source.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;
constexpr std::uint64_t kLargestText_bytes = std::uint64_t{1} << 24u;

/// Columns by name; remembers the first missing one.
class Columns {
 public:
  Columns(const CsvTable& table, std::string source) : table_(table), source_(std::move(source)) {}

  std::vector<double> operator()(const std::string& name) {
    if (!table_.has(name) && missing_.empty()) missing_ = fmt::format("{}: the column {} is missing", source_, name);
    std::vector<double> values = table_.numbers(name);
    values.resize(table_.rows());
    return values;
  }
  std::array<std::vector<double>, 3> vector(const std::string& name) {
    return {(*this)(name + "_x"), (*this)(name + "_y"), (*this)(name + "_z")};
  }
  Result<void> done() const {
    if (missing_.empty()) return {};
    return Error{ErrorCode::malformed, missing_};
  }

 private:
  const CsvTable& table_;
  std::string source_, missing_;
};

/// 0 where a field is no count.
std::uint32_t count(double value) { return value >= 0 && value <= UINT32_MAX ? static_cast<std::uint32_t>(value) : 0; }

Vec3 at(const std::array<std::vector<double>, 3>& v, std::size_t i) { return {v[0][i], v[1][i], v[2][i]}; }

Result<std::vector<Odometry>> read_odometry(const std::string& path) {
  Result<CsvTable> table = CsvTable::read(path);
  if (!table) return table.error();
  Columns columns(*table, path);
  const auto p = columns.vector("p_WB"), q = columns.vector("q_WB"), v = columns.vector("v_WB"), bg = columns.vector("b_gyro"),
             ba = columns.vector("b_accel");
  const auto qw = columns("q_WB_w"), resets = columns("reset_counter");
  std::array<std::array<std::vector<double>, 6>, 6> covariance;
  constexpr const char* kNames[] = {"px", "py", "pz", "tx", "ty", "tz"};
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = i; j < 6; ++j) covariance[i][j] = columns(fmt::format("cov_{}_{}", kNames[i], kNames[j]));
  std::vector<std::string> health = table->texts("health"), reason = table->texts("health_reason");
  if (Result<void> done = columns.done(); !done) return done.error();
  if (health.empty() || reason.empty()) return Error{ErrorCode::malformed, path + ": the column health is missing"};

  std::vector<Odometry> odometry(table->rows());
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    Odometry& o = odometry[k];
    o.t = table->stamps()[k];
    o.T_WB = {Quat(qw[k], q[0][k], q[1][k], q[2][k]).normalized(), at(p, k)};
    o.v_WB = at(v, k);
    o.bias = {at(bg, k), at(ba, k)};
    for (std::size_t i = 0; i < 6; ++i)
      for (std::size_t j = i; j < 6; ++j)
        o.pose_covariance(static_cast<int>(i), static_cast<int>(j)) =
            o.pose_covariance(static_cast<int>(j), static_cast<int>(i)) = covariance[i][j][k];
    o.health = {enumerator_in(health[k], HealthState::lost).value_or(HealthState::lost),
                enumerator_in(reason[k], kLastHealthReason).value_or(HealthReason::none)};
    o.reset_counter = count(resets[k]);
  }
  return odometry;
}

/// Symmetric matrices from their upper triangles. Versions before this file did not write it: no error.
Result<void> read_covariances(const std::string& path, std::vector<Odometry>& odometry) {
  if (!fs::exists(path)) return {};
  Result<CsvTable> table = CsvTable::read(path);
  if (!table) return table.error();
  if (table->rows() != odometry.size())
    return Error{ErrorCode::malformed,
                 fmt::format("{}: {} rows where trajectory.csv has {}", path, table->rows(), odometry.size())};
  Columns columns(*table, path);
  constexpr const char* kAxes[] = {"x", "y", "z"};
  const auto fill = [&](const char* what, Mat3 Odometry::*member) {
    for (int i = 0; i < 3; ++i)
      for (int j = i; j < 3; ++j) {
        const std::vector<double> values = columns(fmt::format("cov_{}_{}_{}", what, kAxes[i], kAxes[j]));
        for (std::size_t k = 0; k < odometry.size(); ++k) (odometry[k].*member)(i, j) = (odometry[k].*member)(j, i) = values[k];
      }
  };
  fill("v", &Odometry::velocity_covariance);
  fill("b_gyro", &Odometry::gyro_bias_covariance);
  fill("b_accel", &Odometry::accel_bias_covariance);
  return columns.done();
}

/// How a file is written that is neither plain TUM nor EuRoC goes to `recognised`.
Result<std::vector<TrajectoryPoint>> read_truth(const std::string& path, std::string& recognised) {
  if (fs::is_directory(path) || path.ends_with(".zip")) {
    DatasetOptions options;
    options.prefetch_frames = 0;
    options.require_imu = false;
    const auto data = open_dataset(path, options);
    if (!data) return data.error();
    return (*data)->ground_truth();
  }
  Result<TrajectoryFile> file = read_trajectory(path);
  if (!file) return file.error();
  recognised = file->recognised;
  return std::move(file->points);
}

/// Reads nothing, without an error, if the folder is not of `fbvins fly`.
Result<void> read_flight(const fs::path& folder, RunFolder& run) {
  if (!fs::exists(folder / "flight.csv") || !fs::exists(folder / "flight.json")) return {};
  Result<CsvTable> rows = CsvTable::read(folder / "flight.csv");
  if (!rows) return rows.error();
  Result<std::string> text = read_file(folder / "flight.json", kLargestText_bytes);
  if (!text) return text.error();
  nlohmann::ordered_json summary = nlohmann::ordered_json::parse(*text, nullptr, false);
  if (summary.is_discarded() || !summary.is_object())
    return Error{ErrorCode::malformed, (folder / "flight.json").string() + ": this is no summary of a flight"};
  run.flight = FlightFiles{std::move(summary), *std::move(rows)};
  return {};
}

std::string text_at(const nlohmann::ordered_json& json, const char* name) {
  return json.contains(name) && json[name].is_string() ? json[name].get<std::string>() : "";
}

}  // namespace

Result<RunFolder> read_run_folder(const std::string& path, const std::string& truth) {
  RunFolder run;
  const fs::path folder(path);
  run.name = (folder.has_filename() ? folder : folder.parent_path()).filename().string();
  if (!fs::is_directory(folder)) return Error{ErrorCode::not_found, path + ": there is no such folder"};
  Result<std::string> summary = read_file(folder / "summary.json", kLargestText_bytes);
  if (!summary) return Error{summary.error().code, path + ": no folder of fbvins run: " + summary.error().message};
  run.summary = nlohmann::ordered_json::parse(*summary, nullptr, false);
  if (run.summary.is_discarded() || !run.summary.contains("result"))
    return Error{ErrorCode::malformed, (folder / "summary.json").string() + ": this is no summary of a run"};
  run.dataset = text_at(run.summary["result"], "dataset");
  run.frontend = text_at(run.summary["result"], "frontend");
  run.version = text_at(run.summary["result"], "version");
  if (Result<std::string> config = read_file(folder / "config.yaml", kLargestText_bytes)) run.config = *std::move(config);

  Result<std::vector<Odometry>> odometry = read_odometry(folder / "trajectory.csv");
  if (!odometry) return odometry.error();
  run.odometry = *std::move(odometry);
  if (Result<void> read = read_covariances(folder / "covariance.csv", run.odometry); !read) return read.error();
  for (auto [file, table] : {std::pair{"statistics.csv", &run.statistics}, {"timing.csv", &run.timing}}) {
    Result<CsvTable> read = CsvTable::read(folder / file);
    if (!read) return read.error();
    *table = *std::move(read);
  }
  if (Result<void> read = read_flight(folder, run); !read) return read.error();
  const fs::path own = folder / "ground_truth.csv";
  if (truth.empty() && !fs::exists(own)) return run;
  Result<std::vector<TrajectoryPoint>> points = read_truth(truth.empty() ? own.string() : truth, run.truth_recognised);
  if (!points) return points.error();
  run.truth = *std::move(points);
  return run;
}

}  // namespace fbvins
