// SPDX-License-Identifier: Apache-2.0
#include "fbvins/report/csv_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "fbvins/io/csv.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargest_bytes = std::uint64_t{1} << 30u;

/// The name without its unit: "p_WB_x [m]" is p_WB_x.
std::string bare_name(std::string_view header) { return std::string(trim(header.substr(0, header.find('[')))); }

}  // namespace

Result<CsvTable> CsvTable::read(const std::string& path) {
  Result<std::string> text = read_file(path, kLargest_bytes);
  if (!text) return text.error();
  return parse(*text, path);
}

Result<CsvTable> CsvTable::parse(std::string_view text, const std::string& source) {
  CsvTable table;
  bool header = false;
  std::vector<std::string_view> fields;
  for (const auto& [number, line] : lines_of(text)) {
    split_at_commas(line, fields);
    if (!std::exchange(header, true)) {
      if (line.front() != '#') return Error{ErrorCode::malformed, fmt::format("{}:1: a header line is missing", source)};
      for (std::size_t i = 1; i < fields.size(); ++i) table.names_.push_back(bare_name(fields[i]));
      table.columns_.resize(table.names_.size());
      continue;
    }
    const auto stamp = parse_nanoseconds(fields[0]);
    if (!stamp) return Error{ErrorCode::malformed, fmt::format("{}:{}: no stamp in nanoseconds", source, number)};
    table.stamps_.push_back(*stamp);
    for (std::size_t i = 0; i < table.columns_.size(); ++i)  // missing fields at the end of a row are empty
      table.columns_[i].emplace_back(i + 1 < fields.size() ? fields[i + 1] : std::string_view{});
  }
  if (!header) return Error{ErrorCode::malformed, source + ": the file is empty"};
  return table;
}

int CsvTable::index(std::string_view column) const {
  const auto at = std::find(names_.begin(), names_.end(), column);
  return at == names_.end() ? -1 : static_cast<int>(at - names_.begin());
}

std::vector<double> CsvTable::numbers(std::string_view column) const {
  std::vector<double> values;
  for (const std::string& text : texts(column)) values.push_back(parse_double(text).value_or(NAN));
  return values;
}

std::vector<std::string> CsvTable::texts(std::string_view column) const {
  const int i = index(column);
  return i < 0 ? std::vector<std::string>{} : columns_[static_cast<std::size_t>(i)];
}

}  // namespace fbvins
