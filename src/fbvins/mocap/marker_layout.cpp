// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/marker_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

using Fields = std::vector<std::string_view>;

std::string_view unquoted(std::string_view text) {
  const bool quoted = text.size() >= 2 && text.front() == '"' && text.back() == '"';
  return quoted ? trim(text.substr(1, text.size() - 2)) : text;
}

/// Names may be quoted with the separator in them.
Fields split_names(char separator, std::string_view line) {
  Fields fields;
  std::size_t from = 0;
  bool inside = false;
  for (std::size_t i = 0; i <= line.size(); ++i) {
    if (i < line.size() && line[i] == '"') inside = !inside;
    if (i < line.size() && (line[i] != separator || inside)) continue;
    fields.push_back(unquoted(trim(line.substr(from, i - from))));
    from = i + 1;
  }
  return fields;
}

std::string_view cell(const Fields& fields, std::size_t i) { return i < fields.size() ? fields[i] : std::string_view{}; }

Error broken(const std::string& file, int line, const std::string& sentence) {
  return {ErrorCode::malformed, fmt::format("{}:{}: {}", file, line, sentence)};
}

std::optional<double> metres_of(std::string_view unit) {
  for (auto [name, metres] :
       {std::pair{"mm", 1e-3}, {"Millimeters", 1e-3}, {"cm", 1e-2}, {"Centimeters", 1e-2}, {"m", 1.0}, {"Meters", 1.0}})
    if (unit == name) return metres;
  return std::nullopt;
}

/// Index of the row of column names; the rest of the header is before it.
std::optional<std::size_t> row_beginning_with(const std::vector<CsvLine>& lines, std::string_view word) {
  constexpr std::size_t kLongestHeader = 40;
  for (std::size_t i = 0; i < std::min(lines.size(), kLongestHeader); ++i)
    if (lines[i].text.substr(0, word.size()) == word) return i;
  return std::nullopt;
}

/// Rows that begin with a number; the first other one begins another table.
std::vector<CsvLine> table_from(const std::vector<CsvLine>& lines, std::size_t first, char separator) {
  std::vector<CsvLine> rows;
  for (std::size_t i = first; i < lines.size(); ++i) {
    const char c = lines[i].text.front();
    if (separator == ',' && ((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'))) break;
    rows.push_back(lines[i]);
  }
  return rows;
}

// -------------------------------------------------------------------------------------------------- OptiTrack Motive

/// "Format Version,1.23,Take Name,...,Rotation Type,Quaternion,Length Units,Meters,...": keys and values in turn.
std::string_view motive_value(const Fields& header, std::string_view key) {
  for (std::size_t i = 0; i + 1 < header.size(); i += 2)
    if (header[i] == key) return header[i + 1];
  return {};
}

/// The row above the column names says what each group is: Rotation, Position, Mean Marker Error.
std::vector<BodyColumns> motive_bodies(const Fields& types, const Fields& names, const Fields& groups) {
  std::vector<BodyColumns> bodies;
  for (std::size_t i = 0; i + 6 < groups.size(); ++i) {
    const bool begins = groups[i] == "Rotation" && (i == 0 || groups[i - 1] != "Rotation");
    if (begins && cell(types, i) == "Rigid Body" && groups[i + 3] == "Rotation" && groups[i + 4] == "Position")
      bodies.push_back({std::string(cell(names, i)), i + 4, i});
  }
  return bodies;
}

Result<MarkerLayout> motive_layout(const std::vector<CsvLine>& lines, const std::string& file) {
  const Fields header = split_names(',', lines.front().text);
  MarkerLayout layout;
  layout.format = "Motive CSV";
  layout.y_up = true;
  layout.time = 1;
  if (const auto rotation = motive_value(header, "Rotation Type"); rotation != "Quaternion")
    return broken(file, lines.front().number, fmt::format("rotations of type '{}': export quaternions", rotation.substr(0, 40)));
  const auto metres = metres_of(motive_value(header, "Length Units"));
  if (!metres)
    return broken(
        file, lines.front().number,
        fmt::format("lengths in '{}': export metres or millimetres", motive_value(header, "Length Units").substr(0, 40)));
  layout.metres = *metres;
  const auto names_at = row_beginning_with(lines, "Frame,");
  if (!names_at || *names_at < 4)
    return broken(file, lines.back().number, "there is no row of column names ('Frame,Time (Seconds),...')");
  const Fields columns = split_names(',', lines[*names_at].text), groups = split_names(',', lines[*names_at - 1].text);
  layout.columns = columns.size();
  layout.bodies = motive_bodies(split_names(',', lines[1].text), split_names(',', lines[2].text), groups);
  if (layout.bodies.empty()) return broken(file, lines[1].number, "there is no rigid body in it: export rigid bodies");
  layout.rows = table_from(lines, *names_at + 1, ',');
  return layout;
}

// -------------------------------------------------------------------------------------------------- Vicon

/// A body is "RX,RY,RZ[,RW],TX,TY,TZ", its name in the row above at the first of these columns.
std::vector<BodyColumns> vicon_bodies(const Fields& names, const Fields& columns, std::size_t angles) {
  std::vector<BodyColumns> bodies;
  for (std::size_t i = 0; i + angles + 2 < columns.size(); ++i)
    if (columns[i] == "RX" && columns[i + angles] == "TX") bodies.push_back({std::string(cell(names, i)), i + angles, i});
  return bodies;
}

Result<MarkerLayout> vicon_layout(const std::vector<CsvLine>& lines, const std::string& file) {
  MarkerLayout layout;
  layout.format = "Vicon CSV";
  const auto names_at = row_beginning_with(lines, "Frame,");
  if (!names_at || *names_at < 2 || *names_at + 1 >= lines.size())
    return broken(file, lines.front().number, "there is no row of column names ('Frame,Sub Frame,RX,...') with units below");
  const auto rate = parse_double(split_names(',', lines[1].text).front());
  if (!rate || !(*rate > 1 && *rate < 1e5)) return broken(file, lines[1].number, "this is not a frame rate in Hz");
  layout.rate_hz = *rate;
  const Fields columns = split_names(',', lines[*names_at].text), units = split_names(',', lines[*names_at + 1].text);
  const bool quaternion = std::find(columns.begin(), columns.end(), "RW") != columns.end();
  layout.rotation = quaternion ? RotationKind::quaternion : RotationKind::rotation_vector;
  layout.columns = columns.size();
  layout.bodies = vicon_bodies(split_names(',', lines[*names_at - 1].text), columns, columns_of(layout.rotation));
  if (layout.bodies.empty())
    return broken(file, lines[*names_at].number, "there is no body with RX,RY,RZ[,RW],TX,TY,TZ: export objects or segments");
  const auto metres = metres_of(cell(units, layout.bodies.front().position));
  if (!metres) return broken(file, lines[*names_at + 1].number, "lengths are neither in mm nor in m");
  layout.metres = *metres;
  layout.radians = cell(units, layout.bodies.front().rotation) == "deg" ? std::numbers::pi / 180 : 1;
  layout.rows = table_from(lines, *names_at + 2, ',');
  return layout;
}

// -------------------------------------------------------------------------------------------------- Qualisys

constexpr std::size_t kQualisysColumns = 16;  // x y z, roll pitch yaw, residual, nine of the rotation

Result<MarkerLayout> qualisys_layout(const std::vector<CsvLine>& lines, const std::string& file) {
  MarkerLayout layout;
  layout.format = "Qualisys TSV";
  layout.separator = '\t';
  layout.metres = 1e-3;
  layout.rotation = RotationKind::matrix_of_columns;
  std::size_t i = 0;
  for (; i < lines.size() && !parse_double(lines[i].text.substr(0, lines[i].text.find('\t'))); ++i) {
    const Fields fields = split_names('\t', lines[i].text);
    const std::string_view value = cell(fields, 1);
    if (fields[0] == "FREQUENCY") layout.rate_hz = parse_double(value).value_or(0);
    if (fields[0] == "DATA_INCLUDED" && value != "6D")
      return broken(file, lines[i].number, fmt::format("{} data: export 6D", value.substr(0, 40)));
    if (fields[0] == "BODY_NAMES")
      for (std::size_t k = 1; k < fields.size(); ++k) layout.bodies.push_back({std::string(fields[k]), 0, 0});
    if (fields[0] == "Frame" && value == "Time") layout.time = 1;
  }
  if (layout.bodies.empty()) return broken(file, lines.front().number, "there is no body in it (BODY_NAMES): export 6D");
  if (!layout.time && !(layout.rate_hz > 1))
    return broken(file, lines.front().number, "there are neither columns 'Frame' and 'Time' nor a FREQUENCY in Hz");
  const std::size_t first = layout.time ? 2 : 1;
  for (std::size_t k = 0; k < layout.bodies.size(); ++k) {
    layout.bodies[k].position = first + k * kQualisysColumns;
    layout.bodies[k].rotation = layout.bodies[k].position + 7;
  }
  layout.columns = first + layout.bodies.size() * kQualisysColumns;
  layout.rows.assign(lines.begin() + static_cast<std::ptrdiff_t>(i), lines.end());
  return layout;
}

}  // namespace

std::size_t columns_of(RotationKind kind) {
  switch (kind) {
    case RotationKind::quaternion: return 4;
    case RotationKind::rotation_vector: return 3;
    case RotationKind::matrix_of_columns: return 9;
  }
  return 0;
}

namespace {

/// Header rows may contradict one another: every cell that will be asked for must be a column.
Result<MarkerLayout> checked(Result<MarkerLayout> layout, const std::string& file) {
  if (!layout) return layout;
  std::size_t last = layout->time.value_or(layout->frame);
  for (const BodyColumns& body : layout->bodies)
    last = std::max({last, body.position + 2, body.rotation + columns_of(layout->rotation) - 1});
  if (last < layout->columns) return layout;
  return Error{ErrorCode::malformed,
               fmt::format("{}: the header names {} columns where its bodies need {}", file, layout->columns, last + 1)};
}

}  // namespace

std::optional<Result<MarkerLayout>> marker_layout(std::string_view text, const std::string& file) {
  const std::vector<CsvLine> lines = lines_of(text);
  if (lines.empty()) return std::nullopt;
  const std::string_view first = lines.front().text;
  const auto begins = [&](std::string_view word) { return first.substr(0, word.size()) == word; };
  if (begins("Format Version,")) return checked(motive_layout(lines, file), file);
  if (begins("FILE_VERSION\t") || begins("NO_OF_FRAMES\t")) return checked(qualisys_layout(lines, file), file);
  const std::string_view title = first.substr(0, first.find(','));
  if (lines.size() > 2 && (title == "Objects" || title == "Segments")) return checked(vicon_layout(lines, file), file);
  if (title == "Trajectories" || title == "Devices" || title == "Model Outputs")
    return Result<MarkerLayout>(
        broken(file, lines.front().number, fmt::format("Vicon's table of {} has no poses: export objects or segments", title)));
  return std::nullopt;
}

}  // namespace fbvins
