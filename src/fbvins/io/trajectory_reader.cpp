// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>

#include "fbvins/io/csv.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/kitti_poses.hpp"
#include "fbvins/io/no_pose.hpp"
#include "fbvins/io/numbers.hpp"
#include "fbvins/io/trajectory.hpp"
#include "fbvins/io/trajectory_columns.hpp"
#include "fbvins/io/trajectory_format.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargestTrajectory_bytes = std::uint64_t{1} << 30u;
constexpr double kLargestValue = 1e9;
// Columns of a stamp, a position and a quaternion; and of our odometry.
constexpr std::size_t kPoseColumns = 8, kOdometryColumns = 41, kHealthColumn = 38;

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

RowVerdict parse_row(const TrajectoryLayout& layout, const std::vector<std::string_view>& fields, TrajectoryPoint& point,
                     std::string& problem) {
  const std::size_t fewest = layout.stamp + kPoseColumns - (layout.angles ? 1 : 0);
  if (fields.size() != layout.columns || fields.size() < fewest) {
    problem = fmt::format("{} columns where {} are needed", fields.size(), std::max(layout.columns, fewest));
    return RowVerdict::malformed;
  }
  const std::string_view stamp = fields[layout.stamp];
  const auto t = parse_stamp(layout, stamp);
  const auto number = t ? std::nullopt : parse_double(stamp);
  problem = t ? "a value is not a usable number"
              : fmt::format("'{}' is not a stamp in {}", stamp.substr(0, 40),
                            layout.unit_ns == 1     ? "nanoseconds"
                            : layout.unit_ns == 1e9 ? "seconds"
                                                    : "its unit");
  if (!t) return number && std::isnan(*number) ? RowVerdict::not_finite : RowVerdict::malformed;
  point.t = *t;
  double v[16];
  const std::size_t count = layout.state ? 16 : layout.velocity ? 10 : layout.angles ? 6 : 7;
  const RowVerdict verdict = parse_doubles(fields, layout.stamp + 1, count, kLargestValue, v);
  if (verdict != RowVerdict::good) return verdict;
  if (layout.state || layout.velocity) point.v_WB = Vec3(v[7], v[8], v[9]);
  if (layout.state) point.bias = ImuBias{Vec3(v[10], v[11], v[12]), Vec3(v[13], v[14], v[15])};
  if (layout.angles) {
    const double a = layout.angle_rad;
    const Quat q = Eigen::AngleAxisd(a * v[5], Vec3::UnitZ()) * Eigen::AngleAxisd(a * v[4], Vec3::UnitY()) *
                   Eigen::AngleAxisd(a * v[3], Vec3::UnitX());
    return set_pose(v, q.w(), q.x(), q.y(), q.z(), point, problem);
  }
  if (layout.quaternion_first) std::rotate(v, v + 4, v + 7);
  return layout.w_first ? set_pose(v, v[3], v[4], v[5], v[6], point, problem)
                        : set_pose(v, v[6], v[3], v[4], v[5], point, problem);
}

bool says_no_pose(const std::vector<std::string_view>& fields) {
  return fields.size() == kOdometryColumns &&
         (fields[kHealthColumn] == to_string(HealthState::initialising) || fields[kHealthColumn] == to_string(HealthState::lost));
}

struct Row {
  Time t;
  TrajectoryPoint point;
  bool no_pose = false, hidden = false;
  std::string health = {};  ///< of a row of ours without a pose
};

/// The rows in order of their stamps; none where they are, or one has no stamp.
std::optional<std::string> sorted_by_stamp(const TrajectoryLayout& layout, const std::vector<CsvLine>& data) {
  std::vector<std::pair<Time, std::string_view>> rows;
  std::vector<std::string_view> fields;
  for (const CsvLine& line : data) {
    split_row(layout, line.text, fields);
    const auto t = fields.size() > layout.stamp ? parse_stamp(layout, fields[layout.stamp]) : std::nullopt;
    if (!t) return std::nullopt;
    rows.emplace_back(*t, line.text);
  }
  const auto earlier = [](const auto& a, const auto& b) { return a.first < b.first; };
  if (std::ranges::is_sorted(rows, earlier)) return std::nullopt;
  std::ranges::stable_sort(rows, earlier);
  std::string out;
  for (const auto& [t, row] : rows) out.append(row) += '\n';
  return out;
}

/// Rows as read_rows() knows them, and what was done to them.
RewrittenRows prepared(std::string_view text, TrajectoryFormat& format) {
  RewrittenRows out{std::string(text), ""};
  for (const auto step : {with_decimal_points, by_column_names, with_no_orientation}) {
    std::optional<RewrittenRows> rows = step(out.text);
    if (!rows) continue;
    out.said += (out.said.empty() ? "" : ", ") + rows->said;
    out.text = std::move(rows->text);
    if (rows->w_first) format.w_first = rows->w_first;
  }
  return out;
}

void add_said(const std::string& said, std::string& recognised) {
  if (!said.empty()) recognised = said + (recognised.empty() ? "" : ", ") + recognised;
}

Result<TrajectoryFile> read_rows(std::string_view text, const std::string& file, const TrajectoryFormat& format);

}  // namespace

Result<TrajectoryFormat> parse_trajectory_format(const std::string& text) {
  TrajectoryFormat out;
  if (text.empty()) return out;
  std::vector<std::string_view> words;
  split_at_commas(text, words);
  for (const std::string_view word : words) {
    if (word == "ns" || word == "us" || word == "ms" || word == "s")
      out.unit_ns = word == "ns" ? 1 : word == "us" ? 1e3 : word == "ms" ? 1e6 : 1e9;
    else if (word == "wxyz" || word == "xyzw") out.w_first = word == "wxyz";
    else return Error{ErrorCode::invalid_argument, fmt::format("'{}' is neither ns, us, ms, s, wxyz nor xyzw", word)};
  }
  return out;
}

Result<TrajectoryFile> parse_trajectory(std::string_view text, const std::string& file, const TrajectoryFormat& given) {
  TrajectoryFormat format = given;
  const RewrittenRows rows = prepared(text, format);
  Result<TrajectoryFile> out = read_rows(rows.text, file, format);
  if (!out) {
    // Refused: where only the order of the rows is wrong they are good once they are sorted.
    const std::vector<CsvLine> lines = lines_of(rows.text), data = data_lines(rows.text);
    const auto layout = recognise(data, lines.empty() ? "" : lines.front().text, file, format);
    const auto sorted = layout ? sorted_by_stamp(*layout, data) : std::nullopt;
    Result<TrajectoryFile> again = out;
    if (sorted) again = read_rows(*sorted, file, {layout->unit_ns, layout->w_first});
    if (sorted && again) {
      out = std::move(again);
      add_said("rows out of order, sorted by their stamps", out->recognised);
    }
  }
  if (out) add_said(rows.said, out->recognised);
  return out;
}

namespace {

Result<TrajectoryFile> read_rows(std::string_view text, const std::string& file, const TrajectoryFormat& format) {
  const std::vector<CsvLine> lines = lines_of(text), data = data_lines(text);
  const auto layout = recognise(data, lines.empty() ? "" : lines.front().text, file, format);
  if (!layout) return layout.error();
  std::vector<std::string_view> fields;
  int nan_rows = 0;
  auto rows = read_stamped_rows<Row>(text, file, [&](std::string_view line, Row& row, std::string& problem) {
    split_row(*layout, line, fields);
    const RowVerdict verdict = parse_row(*layout, fields, row.point, problem);
    row.t = row.point.t;
    row.no_pose = says_no_pose(fields);
    if (row.no_pose) row.health = fmt::format("{}/{}", fields[kHealthColumn], fields[kHealthColumn + 1]);
    // Truth that is NaN where a marker was hidden: however many rows, the others are good.
    row.hidden = !row.no_pose && verdict == RowVerdict::not_finite && row.t != Time{};
    return row.no_pose && verdict == RowVerdict::not_finite ? RowVerdict::good : row.hidden ? RowVerdict::good : verdict;
  });
  if (!rows) return rows.error();
  TrajectoryFile out;
  out.counts = rows->counts;
  out.recognised = layout->recognised;
  std::map<std::string, int> health;
  for (Row& row : rows->rows) {
    row.point.t = row.t;
    if (row.no_pose) ++out.without_pose, ++health[row.health];
    else if (row.hidden) ++nan_rows;
    else out.points.push_back(std::move(row.point));
  }
  out.counts.not_finite += nan_rows;
  if (nan_rows > 0 && out.counts.first_bad.empty())
    out.counts.first_bad = fmt::format("{}: a value is not a usable number", file);
  if (out.points.empty() && nan_rows == 0)
    return Error{ErrorCode::malformed, fmt::format("{}: {}", file, no_pose_sentence(health))};
  if (out.points.empty()) return Error{ErrorCode::malformed, fmt::format("{}: no row has a pose", file)};
  return out;
}

}  // namespace

Result<TrajectoryFile> read_trajectory(const std::string& path, const TrajectoryFormat& format) {
  Result<std::string> text = read_file(path, kLargestTrajectory_bytes);
  if (!text) return text.error();
  // Of a flight without a pose; the file beside it says why.
  const std::filesystem::path beside = std::filesystem::path(path).parent_path() / "trajectory.csv";
  std::error_code ignored;
  if (data_lines(*text).empty() && std::filesystem::path(path).filename() != beside.filename() &&
      std::filesystem::exists(beside, ignored)) {
    const Result<TrajectoryFile> whole = read_trajectory(beside.string());
    if (!whole) return whole.error();
  }
  if (!looks_like_kitti(*text)) return parse_trajectory(*text, path, format);
  const Result<KittiPoses> kitti = kitti_with_times(*text, path);
  if (!kitti) return kitti.error();
  Result<TrajectoryFile> out = parse_trajectory(kitti->tum, path, format);
  if (out) out->recognised = fmt::format("KITTI's poses, with the times of {}", kitti->times);
  return out;
}

}  // namespace fbvins
