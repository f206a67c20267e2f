// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/csv.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/io/no_overlap.hpp"
#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

bool looks_like_header(std::string_view line) {
  const char c = line.front();
  const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '"' || c == '%';
  return letter && !parse_double(line.substr(0, line.find_first_of(", \t")));  // "nan,..." is a bad row
}

}  // namespace

std::vector<CsvLine> lines_of(std::string_view text) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.substr(0, 3) == kByteOrderMark) text.remove_prefix(3);
  std::vector<CsvLine> lines;
  for (int number = 1; !text.empty(); ++number) {
    const auto end = text.find('\n');
    const std::string_view line = trim(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (!line.empty()) lines.push_back({number, line});
  }
  return lines;
}

std::vector<CsvLine> data_lines(std::string_view text) {
  std::vector<CsvLine> lines = lines_of(text);
  std::erase_if(lines, [](const CsvLine& line) { return line.text.front() == '#'; });
  if (!lines.empty() && looks_like_header(lines.front().text)) lines.erase(lines.begin());
  return lines;
}

std::string columns_sentence(std::string_view row, std::size_t columns, std::string_view wanted) {
  const char* instead = columns > 1                                     ? nullptr
                        : row.find(';') != std::string_view::npos       ? "semicolons"
                        : row.find('\t') != std::string_view::npos      ? "tabs"
                        : trim(row).find(' ') != std::string_view::npos ? "blanks"
                                                                        : nullptr;
  const std::string why = instead != nullptr ? fmt::format(": they are between {}, and commas are needed", instead) : "";
  return fmt::format("{} columns where {} are needed{}", columns, wanted, why);
}

void split_at_commas(std::string_view line, std::vector<std::string_view>& fields) { split_at(',', line, fields); }

void split_at(char separator, std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  while (true) {
    const auto end = line.find(separator);
    fields.push_back(trim(line.substr(0, end)));
    if (end == std::string_view::npos) return;
    line.remove_prefix(end + 1);
  }
}

void split_at_blanks(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  for (line = trim(line); !line.empty();) {
    const auto end = line.find_first_of(" \t");
    fields.push_back(line.substr(0, end));
    line = end == std::string_view::npos ? std::string_view{} : trim(line.substr(end));
  }
}

RowVerdict parse_doubles(const std::vector<std::string_view>& fields, std::size_t first, std::size_t count, double largest,
                         double* out) {
  RowVerdict verdict = RowVerdict::good;
  for (std::size_t i = 0; i < count; ++i) {
    const auto value = parse_double(fields[first + i]);
    if (!value) return RowVerdict::malformed;
    if (!(std::abs(*value) <= largest)) verdict = RowVerdict::not_finite;
    out[i] = *value;
  }
  return verdict;
}

std::vector<bool> longest_increasing(const std::vector<Time>& stamps) {
  // Patience sorting; pile k holds, in order of arrival, those whose best run has length k + 1.
  // Inside a pile stamps only fall, so the first one below a bound is also the earliest arrival.
  std::vector<std::vector<std::size_t>> piles;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const auto at = std::lower_bound(piles.begin(), piles.end(), stamps[i],
                                     [&](const auto& pile, Time t) { return stamps[pile.back()] < t; });
    if (at == piles.end()) piles.push_back({i});
    else if (stamps[at->back()] != stamps[i]) at->push_back(i);
  }
  std::vector<bool> keep(stamps.size(), false);
  Time next{kLatestStamp_ns + 1};
  for (auto pile = piles.rbegin(); pile != piles.rend(); ++pile) {
    const std::size_t chosen = *std::find_if(pile->begin(), pile->end(), [&](std::size_t i) { return stamps[i] < next; });
    keep[chosen] = true;
    next = stamps[chosen];
  }
  return keep;
}

Result<void> judge(const RowCounts& counts, const std::string& file) {
  if (counts.rows == 0) return Error{ErrorCode::malformed, fmt::format("{}: there are no data rows in it", file)};
  if (2 * counts.bad() <= counts.rows) return {};
  const std::string shared = shared_stamps(counts.rows, counts.duplicates);
  return Error{ErrorCode::malformed, fmt::format("{} ({} of {} rows are unusable){}{}", counts.first_bad, counts.bad(),
                                                 counts.rows, shared.empty() ? "" : ": ", shared)};
}

}  // namespace fbvins
