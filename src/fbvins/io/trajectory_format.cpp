// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/trajectory_format.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fbvins/io/kitti_poses.hpp"
#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kPose = 8, kPoseAndVelocity = 11, kAngles = 7, kState = 17, kLooked = 200;

/// Years 2001 to 2096.
bool is_date(double seconds) { return seconds > 1e9 && seconds < 4e9; }

const char* name_of(double unit_ns) {
  return unit_ns == 1 ? "nanoseconds" : unit_ns == 1e3 ? "microseconds" : unit_ns == 1e6 ? "milliseconds" : "seconds";
}

/// The unit in which the stamps are dates, or else, of large numbers, have a usual step; `usual` where neither says anything.
double unit_of(const std::vector<double>& stamps, double usual) {
  if (stamps.empty()) return usual;
  const double middle = stamps[stamps.size() / 2];
  for (const double unit : {1.0, 1e3, 1e6, 1e9})
    if (is_date(middle * unit * 1e-9)) return unit;
  constexpr double kTooLarge_s = 1e9;
  if (middle * usual * 1e-9 <= kTooLarge_s || stamps.size() < 2) return usual;
  std::vector<double> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i) steps.push_back(std::abs(stamps[i] - stamps[i - 1]));
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
  constexpr double kFastest_s = 2e-4;
  for (const double unit : {1e6, 1e3})
    if (steps[steps.size() / 2] * unit * 1e-9 >= kFastest_s && steps[steps.size() / 2] * unit * 1e-9 < 10) return unit;
  return 1;
}

bool is_whole(std::string_view text) { return text.find_first_not_of("0123456789") == std::string_view::npos; }

/// Whether the first column counts the rows, and stamps follow.
bool begins_with_number(const std::vector<std::vector<double>>& rows) {
  if (rows.size() < 2 || rows[0].size() < kPose + 1) return false;
  for (std::size_t i = 1; i < rows.size(); ++i)
    if (rows[i].size() < kPose + 1 || rows[i][0] != rows[i - 1][0] + 1 || !(rows[i][1] > rows[i - 1][1])) return false;
  return rows[0][0] == 0 || rows[0][0] == 1;
}

/// Whether four numbers behind the stamp are a quaternion, and those behind the position are none.
bool has_quaternion_first(const std::vector<std::vector<double>>& rows) {
  const auto is_unit = [](const std::vector<double>& row, std::size_t at) {
    double sum = 0;
    for (std::size_t i = at; i < at + 4; ++i) sum += row[i] * row[i];
    return std::abs(std::sqrt(sum) - 1) < 1e-3;
  };
  std::size_t first = 0, last = 0, whole = 0;
  for (const auto& row : rows) {
    if (row.size() < kPose) continue;
    ++whole, first += is_unit(row, 1), last += is_unit(row, 4);
  }
  return whole > 0 && first == whole && 2 * last < whole;
}

/// Seven columns are a pose whose quaternion lacks one, unless the header says otherwise, or the last three cannot be of a
/// quaternion.
bool names_angles(std::string_view header) {
  std::string text(header);
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text.find("roll") != std::string::npos && text.find("pitch") != std::string::npos &&
         text.find("yaw") != std::string::npos;
}

constexpr double kTurn_rad = 6.3;
double largest_angle(const std::vector<std::vector<double>>& rows) {
  double out = 0;
  for (const auto& row : rows)
    for (std::size_t i = 4; i < std::min(row.size(), kAngles); ++i)
      if (std::isfinite(row[i])) out = std::max(out, std::abs(row[i]));
  return out;
}

/// Order of the quaternion by the names of the columns, four that differ by their last letter; none where they do not say.
std::optional<bool> w_first_by(std::string_view header) {
  std::vector<std::string> names(1);
  for (const char c : header) {
    if (std::string_view(", ;\t#").find(c) != std::string_view::npos) {
      if (!names.back().empty() && names.back()[0] != '[') names.emplace_back();
      names.back().clear();
    } else {
      names.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  for (std::size_t i = 0; i + 3 < names.size(); ++i) {
    std::string letters;
    for (std::size_t k = i; k < i + 4 && names[k].size() > 1; ++k)
      if (names[k].substr(0, names[k].size() - 1) == names[i].substr(0, names[i].size() - 1)) letters += names[k].back();
    if (letters == "wxyz" || letters == "xyzw") return letters == "wxyz";
  }
  return std::nullopt;
}

void describe(TrajectoryLayout& layout, bool usual_unit, bool assumed_order) {
  std::vector<std::string> said;
  if (layout.separator == ';') said.emplace_back("columns between semicolons");
  if (layout.stamp == 1) said.emplace_back("a running number before the stamp");
  if (!usual_unit) said.push_back(fmt::format("stamps in {}", name_of(layout.unit_ns)));
  if (layout.quaternion_first) said.emplace_back("the quaternion before the position, as OpenVINS' state_est.txt has it");
  if (layout.angles) said.push_back(fmt::format("roll, pitch and yaw in {}", layout.angle_rad == 1 ? "radians" : "degrees"));
  const bool usual_order = layout.angles || layout.w_first == (layout.separator != ' ');
  if (!usual_order) said.push_back(fmt::format("quaternions {}", layout.w_first ? "w x y z" : "x y z w"));
  const std::size_t known = layout.stamp + (layout.state ? kState : layout.velocity ? kPoseAndVelocity : kPose);
  if (layout.velocity) said.emplace_back("the velocity behind the pose");
  else if (!layout.state && layout.columns > known && !layout.angles)
    said.push_back(fmt::format("{} further columns left out", layout.columns - known));
  layout.recognised = fmt::format("{}", fmt::join(said, ", "));
  if (assumed_order) layout.recognised += " (if that is wrong: --format wxyz)";
}

}  // namespace

void split_row(const TrajectoryLayout& layout, std::string_view line, std::vector<std::string_view>& fields) {
  layout.separator == ' ' ? split_at_blanks(line, fields) : split_at(layout.separator, line, fields);
  while (!fields.empty() && fields.back().empty()) fields.pop_back();
}

std::optional<Time> parse_stamp(const TrajectoryLayout& layout, std::string_view text) {
  if (layout.unit_ns == 1 && is_whole(text)) return parse_nanoseconds(text);
  if (layout.unit_ns == 1e9) return parse_seconds(text);
  // The same digits with another exponent: no double in between.
  int exponent = layout.unit_ns == 1 ? -9 : layout.unit_ns == 1e3 ? -6 : -3;
  if (const auto e = text.find_first_of("eE"); e != std::string_view::npos) {
    const auto own = parse_double(text.substr(e + 1));
    if (!own || std::abs(*own) > 100) return std::nullopt;
    exponent += static_cast<int>(*own);
    text = text.substr(0, e);
  }
  return parse_seconds(fmt::format("{}e{}", text, exponent));
}

Result<TrajectoryLayout> recognise(const std::vector<CsvLine>& data, std::string_view header, const std::string& file,
                                   const TrajectoryFormat& wanted) {
  TrajectoryLayout layout;
  if (data.empty()) return layout;
  const std::string_view first = data.front().text;
  layout.separator = first.find(',') != std::string_view::npos ? ',' : first.find(';') != std::string_view::npos ? ';' : ' ';
  std::vector<std::string_view> fields;
  std::vector<std::vector<double>> rows;
  std::vector<std::size_t> counts;
  bool whole = true;
  for (std::size_t i = 0; i < std::min(data.size(), kLooked); ++i) {
    split_row(layout, data[i].text, fields);
    counts.push_back(fields.size());
    rows.emplace_back();
    for (const std::string_view field : fields) rows.back().push_back(parse_double(field).value_or(NAN));
    if (!fields.empty() && !std::isnan(rows.back()[0])) whole = whole && is_whole(fields[0]);
  }
  std::nth_element(counts.begin(), counts.begin() + static_cast<std::ptrdiff_t>(counts.size() / 2), counts.end());
  layout.columns = counts[counts.size() / 2];
  layout.stamp = begins_with_number(rows) ? 1 : 0;
  if (looks_like_kitti(first))
    return Error{ErrorCode::unsupported,
                 fmt::format("{}: KITTI's poses, 12 numbers a row without a time: put its times.txt beside it", file)};
  std::vector<double> stamps;
  for (const auto& row : rows)
    if (row.size() > layout.stamp && std::isfinite(row[layout.stamp])) stamps.push_back(row[layout.stamp]);
  const bool euroc = layout.separator != ' ' && whole && layout.stamp == 0;
  if (euroc && layout.columns > kPose && layout.columns != kPoseAndVelocity && layout.columns < kState)
    return Error{ErrorCode::malformed, fmt::format("{}:{}: {} columns where {}, {} or at least {} are needed", file,
                                                   data.front().number, layout.columns, kPose, kPoseAndVelocity, kState)};
  layout.unit_ns = wanted.unit_ns > 0 ? wanted.unit_ns : unit_of(stamps, euroc ? 1 : 1e9);
  const std::optional<bool> named = w_first_by(header);
  layout.w_first = wanted.w_first.value_or(named.value_or(euroc));
  layout.quaternion_first = layout.stamp == 0 && has_quaternion_first(rows);
  layout.angles = layout.stamp == 0 && layout.columns == kAngles &&
                  (names_angles(header) || (layout.separator == ' ' && largest_angle(rows) > kTurn_rad));
  if (layout.angles) layout.angle_rad = largest_angle(rows) > kTurn_rad ? std::numbers::pi / 180 : 1;
  if (layout.quaternion_first) layout.w_first = wanted.w_first.value_or(named.value_or(false));
  layout.state =
      layout.separator != ' ' && layout.stamp == 0 && layout.columns >= kState && layout.w_first && !layout.quaternion_first;
  layout.velocity =
      layout.separator != ' ' && layout.stamp == 0 && layout.columns == kPoseAndVelocity && !layout.quaternion_first;
  const bool usual = euroc ? layout.unit_ns == 1 : layout.separator == ' ' && layout.unit_ns == 1e9;
  describe(layout, usual, layout.separator != ' ' && !layout.w_first && !named && !wanted.w_first && layout.stamp == 0);
  return layout;
}

}  // namespace fbvins
