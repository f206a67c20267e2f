// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fbvins/io/csv.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/numbers.hpp"
#include "fbvins/io/trajectory.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargestTrajectory_bytes = std::uint64_t{1} << 30u;
constexpr double kLargestValue = 1e9;
// Columns of EuRoC's ground truth: stamp, position, quaternion, velocity, two biases; and of ours.
constexpr std::size_t kPoseColumns = 8, kStateColumns = 17, kOdometryColumns = 41, kHealthColumn = 38;

/// q is w x y z. Files round; what is further from length 1 than that is no rotation.
RowVerdict set_pose(const double* p, double w, double x, double y, double z, TrajectoryPoint& point, std::string& problem) {
  const Quat q(w, x, y, z);
  if (!(std::abs(q.norm() - 1.0) < 0.02)) {
    problem = fmt::format("the quaternion's length is {:.4g}", q.norm());
    return RowVerdict::malformed;
  }
  point.T_WB = {q.normalized(), Vec3(p[0], p[1], p[2])};
  return RowVerdict::good;
}

RowVerdict parse_tum_row(const std::vector<std::string_view>& fields, TrajectoryPoint& point, std::string& problem) {
  if (fields.size() != kPoseColumns) {
    problem = fmt::format("{} columns where {} are needed", fields.size(), kPoseColumns);
    return RowVerdict::malformed;
  }
  const auto t = parse_seconds(fields[0]);
  problem = t ? "a value is not a usable number" : fmt::format("'{}' is not a stamp in seconds", fields[0].substr(0, 40));
  if (!t) return RowVerdict::malformed;
  point.t = *t;
  double v[7];
  if (const RowVerdict verdict = parse_doubles(fields, 1, 7, kLargestValue, v); verdict != RowVerdict::good) return verdict;
  return set_pose(v, v[6], v[3], v[4], v[5], point, problem);
}

RowVerdict parse_euroc_row(const std::vector<std::string_view>& fields, TrajectoryPoint& point, std::string& problem) {
  if (fields.size() != kPoseColumns && fields.size() < kStateColumns) {
    problem = fmt::format("{} columns where {} or at least {} are needed", fields.size(), kPoseColumns, kStateColumns);
    return RowVerdict::malformed;
  }
  const auto t = parse_nanoseconds(fields[0]);
  problem = t ? "a value is not a usable number" : fmt::format("'{}' is not a stamp in nanoseconds", fields[0].substr(0, 40));
  if (!t) return RowVerdict::malformed;
  point.t = *t;
  double v[16];
  const bool state = fields.size() >= kStateColumns;
  const RowVerdict verdict = parse_doubles(fields, 1, state ? 16 : 7, kLargestValue, v);
  if (verdict != RowVerdict::good) return verdict;
  if (state) {
    point.v_WB = Vec3(v[7], v[8], v[9]);
    point.bias = ImuBias{Vec3(v[10], v[11], v[12]), Vec3(v[13], v[14], v[15])};
  }
  return set_pose(v, v[3], v[4], v[5], v[6], point, problem);
}

bool says_no_pose(const std::vector<std::string_view>& fields) {
  return fields.size() == kOdometryColumns &&
         (fields[kHealthColumn] == to_string(HealthState::initialising) || fields[kHealthColumn] == to_string(HealthState::lost));
}

bool has_commas(std::string_view text) {
  const std::vector<CsvLine> lines = data_lines(text.substr(0, 1u << 16u));
  return !lines.empty() && lines.front().text.find(',') != std::string_view::npos;
}

struct Row {
  Time t;
  TrajectoryPoint point;
  bool no_pose = false;
};

}  // namespace

Result<TrajectoryFile> parse_trajectory(std::string_view text, const std::string& file) {
  const bool commas = has_commas(text);
  std::vector<std::string_view> fields;
  auto rows = read_stamped_rows<Row>(text, file, [&](std::string_view line, Row& row, std::string& problem) {
    commas ? split_at_commas(line, fields) : split_at_blanks(line, fields);
    const RowVerdict verdict = commas ? parse_euroc_row(fields, row.point, problem) : parse_tum_row(fields, row.point, problem);
    row.t = row.point.t;
    row.no_pose = says_no_pose(fields);
    return row.no_pose && verdict == RowVerdict::not_finite ? RowVerdict::good : verdict;
  });
  if (!rows) return rows.error();
  TrajectoryFile out;
  out.counts = rows->counts;
  for (Row& row : rows->rows) {
    if (row.no_pose) ++out.without_pose;
    else out.points.push_back(std::move(row.point));
  }
  if (out.points.empty()) return Error{ErrorCode::malformed, fmt::format("{}: no row has a pose", file)};
  return out;
}

Result<TrajectoryFile> read_trajectory(const std::string& path) {
  Result<std::string> text = read_file(path, kLargestTrajectory_bytes);
  if (!text) return text.error();
  return parse_trajectory(*text, path);
}

}  // namespace fbvins
