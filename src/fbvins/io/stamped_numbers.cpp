// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/stamped_numbers.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "fbvins/io/numbers.hpp"

namespace fbvins {

RowVerdict NumbersRowParser::operator()(std::string_view line, StampedNumbers& row, std::string& problem) {
  split_at_commas(line, fields_);
  row.count = fields_.size() - 1;
  if (std::ranges::find(counts_, row.count) == counts_.end()) {
    std::vector<std::size_t> columns = counts_;
    for (std::size_t& c : columns) ++c;
    problem = columns_sentence(line, fields_.size(), fmt::format("{}", fmt::join(columns, " or ")));
    return RowVerdict::malformed;
  }
  const auto stamp = parse_nanoseconds(fields_[0]);
  if (!stamp) {
    problem = fmt::format("'{}' is not a stamp in nanoseconds", fields_[0].substr(0, 40));
    return RowVerdict::malformed;
  }
  row.t = *stamp;
  if (sees_nothing_ && fields_[1] == "inf") return row.values[0] = largest_, RowVerdict::good;
  const RowVerdict verdict = parse_doubles(fields_, 1, row.count, largest_, row.values.data());
  if (verdict != RowVerdict::good) problem = "a value is not a usable number";
  return verdict;
}

}  // namespace fbvins
