// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/trajectory_columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <vector>

#include "fbvins/io/csv.hpp"
#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kRowsLooked = 20, kPositionColumns = 4;

/// Lower-case, without quotes, a mark of a comment, or a unit in brackets.
std::string plain_name(std::string_view field) {
  std::string out;
  for (const char c : field.substr(0, field.find(" [")))
    if (c != '"' && c != '#' && c != '%' && c != ' ') out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

std::vector<std::string> names_of(std::string_view header, char separator) {
  std::vector<std::string_view> fields;
  if (separator == ' ') {
    if (header.starts_with('#')) header.remove_prefix(1);
    split_at_blanks(header, fields);
  } else {
    split_at(separator, header, fields);
  }
  std::vector<std::string> out;
  for (const std::string_view field : fields) {
    const bool unit = separator == ' ' && (field.starts_with('[') || field.starts_with('('));
    if (!unit) out.push_back(plain_name(field));
  }
  return out;
}

using Columns = std::vector<std::size_t>;

/// Names of several parts may stand behind others: field.pose.pose.position.x.
std::optional<std::size_t> column_of(const std::vector<std::string>& names, std::string_view wanted) {
  const bool of_parts = wanted.find_first_of(".[") != std::string_view::npos;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string_view name = names[i];
    const bool behind_dot =
        of_parts && name.size() > wanted.size() && name.ends_with(wanted) && name[name.size() - wanted.size() - 1] == '.';
    if (name == wanted || behind_dot) return i;
  }
  return std::nullopt;
}

/// All of the names, or none.
template <std::size_t count>
Columns columns_of(const std::vector<std::string>& names, const std::vector<std::array<const char*, count>>& wanted) {
  for (const auto& group : wanted) {
    Columns out;
    for (const char* name : group)
      if (const auto column = column_of(names, name)) out.push_back(*column);
    if (out.size() == count) return out;
  }
  return {};
}

/// Stamp, x, y, z, and w, x, y, z where they are named.
Columns find_columns(const std::vector<std::string>& names) {
  // The time at which something was measured before that at which it was sent or written.
  Columns out = columns_of<1>(names, {{"header.stamp"}, {"timestamp_sample"}, {"timestamp"}, {"stamp"}, {"time"}, {"t"}});
  const Columns p = columns_of<3>(names, {{"position.x", "position.y", "position.z"},
                                          {"translation.x", "translation.y", "translation.z"},
                                          {"point.x", "point.y", "point.z"},
                                          {"position[0]", "position[1]", "position[2]"},
                                          {"position_x", "position_y", "position_z"},
                                          {"pos_x", "pos_y", "pos_z"},
                                          {"p_x", "p_y", "p_z"},
                                          {"p_rs_r_x", "p_rs_r_y", "p_rs_r_z"},
                                          {"px", "py", "pz"},
                                          {"tx", "ty", "tz"},
                                          {"x", "y", "z"}});
  const Columns q = columns_of<4>(names, {{"orientation.w", "orientation.x", "orientation.y", "orientation.z"},
                                          {"rotation.w", "rotation.x", "rotation.y", "rotation.z"},
                                          {"q[0]", "q[1]", "q[2]", "q[3]"},
                                          {"orientation_w", "orientation_x", "orientation_y", "orientation_z"},
                                          {"rot_w", "rot_x", "rot_y", "rot_z"},
                                          {"q_w", "q_x", "q_y", "q_z"},
                                          {"q_rs_w", "q_rs_x", "q_rs_y", "q_rs_z"},
                                          {"qw", "qx", "qy", "qz"}});
  if (out.empty() || p.empty()) return {};
  out.insert(out.end(), p.begin(), p.end());
  out.insert(out.end(), q.begin(), q.end());
  return out;
}

/// Where a reader without names looks: a stamp, maybe behind a running number, a position, a quaternion of either order.
bool in_usual_places(const Columns& columns) {
  const std::size_t stamp = columns[0];
  if (stamp > 1) return false;
  for (std::size_t i = 1; i < 4; ++i)
    if (columns[i] != stamp + i) return false;
  if (columns.size() < 8) return false;
  const Columns q(columns.begin() + 4, columns.end());
  return std::ranges::min(q) == stamp + 4 && std::ranges::max(q) == stamp + 7;
}

bool names_angles(const std::vector<std::string>& names) {
  return column_of(names, "roll") && column_of(names, "pitch") && column_of(names, "yaw");
}

char separator_of(std::string_view row) {
  return row.find(',') != std::string_view::npos ? ',' : row.find(';') != std::string_view::npos ? ';' : ' ';
}

void split(char separator, std::string_view line, std::vector<std::string_view>& fields) {
  separator == ' ' ? split_at_blanks(line, fields) : split_at(separator, line, fields);
}

/// Of the lines before the rows the last one names the columns.
std::vector<std::string> names_above(std::string_view text, const std::vector<CsvLine>& data, char separator) {
  const std::vector<CsvLine> lines = lines_of(text);
  const auto first = std::ranges::find(lines, data.front().number, &CsvLine::number);
  return first == lines.begin() ? std::vector<std::string>{} : names_of(std::prev(first)->text, separator);
}

/// In the line that it had in the file.
void add_row(int line, const std::string& row, int& lines, std::string& out) {
  for (; lines < line - 1; ++lines) out += '\n';
  out += row + '\n';
  ++lines;
}

}  // namespace

std::optional<RewrittenRows> with_decimal_points(std::string_view text) {
  const std::vector<CsvLine> data = data_lines(text);
  if (data.empty()) return std::nullopt;
  const bool semicolons = data.front().text.find(';') != std::string_view::npos;
  std::vector<std::string_view> fields;
  int commas = 0;
  for (std::size_t i = 0; i < std::min(data.size(), kRowsLooked); ++i) {
    split(semicolons ? ';' : ' ', data[i].text, fields);
    if (fields.size() < kPositionColumns) return std::nullopt;
    for (const std::string_view field : fields) {
      const auto comma = field.find(',');
      if (comma == std::string_view::npos) continue;
      std::string number(field);
      number[comma] = '.';
      if (comma + 1 == field.size() || !parse_double(number)) return std::nullopt;
      ++commas;
    }
  }
  if (commas == 0) return std::nullopt;
  std::string out(text);
  std::ranges::replace(out, ',', '.');
  return RewrittenRows{std::move(out), "decimal commas"};
}

std::optional<RewrittenRows> by_column_names(std::string_view text) {
  const std::vector<CsvLine> data = data_lines(text);
  if (data.empty()) return std::nullopt;
  const char separator = separator_of(data.front().text);
  const std::vector<std::string> names = names_above(text, data, separator);
  std::vector<std::string_view> fields;
  split(separator, data.front().text, fields);
  const Columns columns = find_columns(names);
  // Between blanks a name of two words is two: then they are no names of columns.
  const bool fits = separator == ' ' ? names.size() == fields.size() : names.size() >= fields.size();
  if (columns.empty() || !fits || in_usual_places(columns)) return std::nullopt;
  const bool oriented = columns.size() == 8;
  if (!oriented && names_angles(names)) return std::nullopt;
  RewrittenRows out{"", "columns by their names", true};
  int written = 0;
  for (const CsvLine& line : data) {
    split(separator, line.text, fields);
    std::string row;
    for (const std::size_t column : columns)
      row += fmt::format("{}{}", row.empty() ? "" : ",", column < fields.size() ? fields[column] : "");
    add_row(line.number, row + (oriented ? "" : ",1,0,0,0"), written, out.text);
  }
  return out;
}

std::optional<RewrittenRows> with_no_orientation(std::string_view text) {
  const std::vector<CsvLine> data = data_lines(text);
  if (data.empty()) return std::nullopt;
  const char separator = separator_of(data.front().text);
  // Four columns of other names: latitudes, rates.
  if (const auto names = names_above(text, data, separator); names.size() == kPositionColumns && find_columns(names).empty())
    return std::nullopt;
  std::vector<std::string_view> fields;
  for (std::size_t i = 0; i < std::min(data.size(), kRowsLooked); ++i) {
    split(separator, data[i].text, fields);
    if (fields.size() != kPositionColumns || !parse_double(fields[0])) return std::nullopt;
  }
  RewrittenRows out{"", "", separator != ' '};
  const char* none = separator == ' ' ? " 0 0 0 1" : separator == ';' ? ";1;0;0;0" : ",1,0,0,0";
  int written = 0;
  for (const CsvLine& line : data) add_row(line.number, std::string(line.text) + none, written, out.text);
  return out;
}

}  // namespace fbvins
