// SPDX-License-Identifier: Apache-2.0
// Rows of numbers with a stamp. Unusable rows are counted and left out; they are an error only where they are
// more than half. Pure functions, any thread.
//
//   Result<StampedRows<ImuSample>> imu = read_stamped_rows<ImuSample>(text, "imu0/data.csv", parse_imu_row);
//   imu->rows;             // strictly increasing stamps
//   imu->counts.bad();     // how many rows were left out
//
// Accepted: CRLF, byte order mark, comments (#), blank lines, one header line, no newline at the end.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/io/clock_steps.hpp"
#include "fbvins/io/row_counts.hpp"

namespace fbvins {

/// Result of parsing one row.
enum class RowVerdict { good, not_finite, malformed };

template <class Row>
struct StampedRows {
  std::vector<Row> rows;
  RowCounts counts;
};

/// One line of a file.
struct CsvLine {
  int number = 0;  ///< from 1
  std::string_view text;
};

/// Every line that is not blank, trimmed, without the byte order mark.
std::vector<CsvLine> lines_of(std::string_view text);
/// Those of them that hold data: no comments, no header.
std::vector<CsvLine> data_lines(std::string_view text);

/// "N columns where WANTED are needed", and which separator the row has instead of commas.
std::string columns_sentence(std::string_view row, std::size_t columns, std::string_view wanted);

/// Splits at commas, or at another separator; outer blanks removed. The vector is reused from row to row.
void split_at_commas(std::string_view line, std::vector<std::string_view>& fields);
void split_at(char separator, std::string_view line, std::vector<std::string_view>& fields);
/// Splits at runs of blanks and tabs.
void split_at_blanks(std::string_view line, std::vector<std::string_view>& fields);

/// Parses fields[first, first + out_count) into out; not_finite for values above `largest` in size.
RowVerdict parse_doubles(const std::vector<std::string_view>& fields, std::size_t first, std::size_t count, double largest,
                         double* out);

/// Marks the stamps to keep: the longest strictly increasing subsequence, so that one stamp from the
/// far future costs one row and not all that follow. The first of equal stamps is kept.
std::vector<bool> longest_increasing(const std::vector<Time>& stamps);

/// An error if there are no rows or fewer than half of them are good.
Result<void> judge(const RowCounts& counts, const std::string& file);

/// The good rows of a file in the order of its lines, of which some stamps may go back.
template <class Row>
struct ParsedRows {
  std::string file;
  std::vector<Row> rows;
  std::vector<int> lines;  ///< of each row
  RowCounts counts;
  int first_bad_line = 0;

  void blame(int line, std::string_view problem) {
    if (first_bad_line != 0 && first_bad_line <= line) return;
    first_bad_line = line;
    counts.first_bad = fmt::format("{}:{}: {}", file, line, problem);
  }
  std::vector<Time> stamps() const {
    std::vector<Time> out;
    for (const Row& row : rows) out.push_back(row.t);
    return out;
  }
};

/// Reads all lines with parse(line, row, problem) -> RowVerdict, `problem` saying what is
/// wrong in words; Row needs a member `Time t`. Counters that wrapped are continued.
template <class Row, class Parse>
ParsedRows<Row> parse_stamped_lines(const std::vector<CsvLine>& data, const std::string& file, Parse&& parse) {
  ParsedRows<Row> out;
  out.file = file;
  std::string problem;
  for (const CsvLine& line : data) {
    ++out.counts.rows;
    Row row{};
    problem.clear();
    const RowVerdict verdict = parse(line.text, row, problem);
    if (verdict == RowVerdict::good) {
      out.rows.push_back(std::move(row));
      out.lines.push_back(line.number);
      continue;
    }
    ++(verdict == RowVerdict::malformed ? out.counts.malformed : out.counts.not_finite);
    out.blame(line.number, problem);
  }
  std::vector<Time> stamps = out.stamps();
  out.counts.wraps = continue_wrapped(stamps);
  for (std::size_t i = 0; i < stamps.size(); ++i) out.rows[i].t = stamps[i];
  return out;
}

/// Leaves out rows whose stamps are out of order, or were there before.
template <class Row>
Result<StampedRows<Row>> in_order(ParsedRows<Row> parsed) {
  StampedRows<Row> out;
  const std::vector<bool> keep = longest_increasing(parsed.stamps());
  Time previous{-1};
  for (std::size_t i = 0; i < parsed.rows.size(); ++i) {
    Row& row = parsed.rows[i];
    if (keep[i]) {
      previous = row.t;
      out.rows.push_back(std::move(row));
    } else {
      const bool duplicate = row.t == previous;
      ++(duplicate ? parsed.counts.duplicates : parsed.counts.backwards);
      parsed.blame(parsed.lines[i], duplicate ? "the stamp was already there" : "the stamp is out of order");
    }
  }
  if (Result<void> verdict = judge(parsed.counts, parsed.file); !verdict) return verdict.error();
  out.counts = std::move(parsed.counts);
  return out;
}

/// Both of them.
template <class Row, class Parse>
Result<StampedRows<Row>> read_stamped_lines(const std::vector<CsvLine>& data, const std::string& file, Parse&& parse) {
  return in_order(parse_stamped_lines<Row>(data, file, std::forward<Parse>(parse)));
}

/// The same of a whole file without its header.
template <class Row, class Parse>
Result<StampedRows<Row>> read_stamped_rows(std::string_view text, const std::string& file, Parse&& parse) {
  return read_stamped_lines<Row>(data_lines(text), file, std::forward<Parse>(parse));
}

}  // namespace fbvins
