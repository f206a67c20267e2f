// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/motion_capture.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "fbvins/io/file_source.hpp"
#include "fbvins/io/kitti_poses.hpp"
#include "fbvins/io/mcap_format.hpp"
#include "fbvins/io/numbers.hpp"
#include "fbvins/io/trajectory.hpp"
#include "fbvins/mocap/marker_layout.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargestFile_bytes = std::uint64_t{1} << 31u;
constexpr double kLargestValue = 1e9;
constexpr double kLargestSize_m = 1e4;  // of a volume: beyond it the stated unit must be wrong

/// y up to z up: z of the file points backwards.
const Quat& upright() {
  static const Quat q(std::sqrt(0.5), std::sqrt(0.5), 0, 0);
  return q;
}

struct Row {
  Time t;
  std::vector<std::optional<Pose<V, K>>> bodies;
};

class RowParser {
 public:
  explicit RowParser(const MarkerLayout& layout) : layout_(layout) {}

  RowVerdict operator()(std::string_view line, Row& row, std::string& problem) {
    split_at(layout_.separator, line, fields_);
    if (fields_.size() > layout_.columns) {
      // A separator at the end of the row is no column.
      if (fields_.size() > layout_.columns + 1 || !fields_.back().empty()) {
        problem = fmt::format("{} columns where {} are named", fields_.size(), layout_.columns);
        return RowVerdict::malformed;
      }
    }
    fields_.resize(layout_.columns);
    const auto t = stamp();
    problem = "this row has no stamp";
    if (!t) return RowVerdict::malformed;
    row.t = *t;
    for (const BodyColumns& body : layout_.bodies) {
      row.bodies.emplace_back();
      if (!seen(body)) continue;
      if (const RowVerdict verdict = parse(body, row.bodies.back(), problem); verdict != RowVerdict::good) return verdict;
    }
    return RowVerdict::good;
  }

 private:
  std::optional<Time> stamp() const {
    if (layout_.time) return parse_seconds(fields_[*layout_.time]);
    const auto frame = parse_double(fields_[layout_.frame]);
    if (!frame || !(*frame >= 0 && *frame < 1e12)) return std::nullopt;
    const double seconds = *frame / layout_.rate_hz;
    if (!(seconds * 1e9 < static_cast<double>(kLatestStamp_ns))) return std::nullopt;
    return Time{} + Duration::from_seconds(seconds);
  }

  /// Systems leave the cells of a body that they do not see empty, or write NaN or zeros.
  bool seen(const BodyColumns& body) const {
    bool zeros = true;
    for (std::size_t i = 0; i < 3 + columns_of(layout_.rotation); ++i) {
      const std::string_view field = fields_[i < 3 ? body.position + i : body.rotation + i - 3];
      const auto value = field.empty() ? std::optional(std::numeric_limits<double>::quiet_NaN()) : parse_double(field);
      if (value && std::isnan(*value)) return false;
      if (i < 3 && !(value && *value == 0)) zeros = false;
    }
    return !zeros;
  }

  RowVerdict parse(const BodyColumns& body, std::optional<Pose<V, K>>& out, std::string& problem) const {
    double p[3], r[9];
    problem = "a value is not a usable number";
    for (const RowVerdict verdict : {parse_doubles(fields_, body.position, 3, kLargestValue, p),
                                     parse_doubles(fields_, body.rotation, columns_of(layout_.rotation), kLargestValue, r)})
      if (verdict != RowVerdict::good) return verdict;
    const auto q = rotation(r, problem);
    const Vec3 position = layout_.metres * Vec3(p[0], p[1], p[2]);
    if (!q) return RowVerdict::malformed;
    if (position.norm() > kLargestSize_m) {
      problem = fmt::format("{:.0f} m from the origin: is the unit of length right?", position.norm());
      return RowVerdict::malformed;
    }
    out = layout_.y_up ? Pose<V, K>{(upright() * *q).normalized(), Vec3(upright() * position)} : Pose<V, K>{*q, position};
    return RowVerdict::good;
  }

  std::optional<Quat> rotation(const double* r, std::string& problem) const {
    if (layout_.rotation == RotationKind::quaternion) {
      const Quat q(r[3], r[0], r[1], r[2]);
      problem = fmt::format("the quaternion's length is {:.4g}", q.norm());
      return std::abs(q.norm() - 1) < 0.02 ? std::optional(q.normalized()) : std::nullopt;
    }
    if (layout_.rotation == RotationKind::rotation_vector) {
      const Vec3 v = layout_.radians * Vec3(r[0], r[1], r[2]);
      problem = fmt::format("a rotation by {:.0f} degrees: these are not helical angles; export quaternions",
                            v.norm() * 180 / std::numbers::pi);
      return v.norm() < 1.02 * std::numbers::pi ? std::optional(so3_exp(v)) : std::nullopt;
    }
    const Mat3 R = Eigen::Map<const Mat3>(r);  // Eigen's order is column after column
    problem = "the nine elements are not those of a rotation";
    if (!((R.transpose() * R - Mat3::Identity()).norm() < 0.02) || !(R.col(0).cross(R.col(1)).dot(R.col(2)) > 0))
      return std::nullopt;
    return Quat(R).normalized();
  }

  const MarkerLayout& layout_;
  std::vector<std::string_view> fields_;
};

Result<MotionCapture> read_table(const MarkerLayout& layout, const std::string& file) {
  auto rows = read_stamped_lines<Row>(layout.rows, file, RowParser(layout));
  if (!rows) return rows.error();
  MotionCapture out{layout.format, {}, rows->counts};
  for (std::size_t i = 0; i < layout.bodies.size(); ++i) {
    MarkerBody body{layout.bodies[i].name, {}, 0};
    for (const Row& row : rows->rows) {
      if (row.bodies[i]) body.track.push_back({row.t, *row.bodies[i]});
      else ++body.unseen;
    }
    out.bodies.push_back(std::move(body));
  }
  return out;
}

/// TUM's and EuRoC's files, and our own: one body without a name.
Result<MotionCapture> read_plain(std::string_view text, const std::string& file) {
  const auto trajectory = parse_trajectory(text, file);
  if (!trajectory) return trajectory.error();
  MarkerTrack track;
  for (const TrajectoryPoint& point : trajectory->points) track.push_back({point.t, point.T_WB.cast_frames<V, K>()});
  const bool commas = data_lines(text.substr(0, 1u << 16u)).front().text.find(',') != std::string_view::npos;
  std::string format = commas ? "EuRoC CSV" : "TUM";
  if (!trajectory->recognised.empty()) format += ": " + trajectory->recognised;
  return MotionCapture{std::move(format), {{"", std::move(track), trajectory->without_pose}}, trajectory->counts};
}

}  // namespace

Result<MotionCapture> parse_motion_capture(std::string_view text, const std::string& file) {
  const auto layout = marker_layout(text, file);
  if (!layout) return read_plain(text, file);
  if (!*layout) return layout->error();
  return read_table(**layout, file);
}

Result<MotionCapture> read_motion_capture(const std::string& path) {
  const auto bytes = open_bytes(path);
  if (!bytes) return bytes.error();
  if ((*bytes)->read(0, kMcapMagic.size()) == kMcapMagic) return read_marker_topics(*bytes, path);
  auto text = read_file(path, kLargestFile_bytes);
  if (!text) return text.error();
  if (looks_like_kitti(*text)) {
    auto kitti = kitti_with_times(*text, path);
    if (!kitti) return kitti.error();
    text = std::move(kitti->tum);
  }
  return parse_motion_capture(*text, path);
}

Result<MarkerBody> choose_body(MotionCapture recording, std::string_view name, const std::string& file) {
  std::string names;
  for (MarkerBody& body : recording.bodies) {
    const bool chosen = name.empty() ? recording.bodies.size() == 1 : body.name == name;
    if (chosen && body.track.empty())
      return Error{ErrorCode::malformed, fmt::format("{}: the body '{}' is never seen", file, body.name)};
    if (chosen) return std::move(body);
    fmt::format_to(std::back_inserter(names), "{}'{}'", names.empty() ? "" : ", ", body.name);
  }
  if (name.empty())
    return Error{ErrorCode::invalid_argument,
                 fmt::format("{}: there are {} bodies in it, choose one by name: {}", file, recording.bodies.size(), names)};
  return Error{ErrorCode::not_found, fmt::format("{}: there is no body '{}' in it, only {}", file, name, names)};
}

}  // namespace fbvins
