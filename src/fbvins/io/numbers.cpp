// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/numbers.hpp"

#include <fmt/format.h>

#include <charconv>

namespace fbvins {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// digits * 10^exponent, as far as 19 significant digits go.
struct Decimal {
  std::uint64_t digits = 0;
  int exponent = 0;
};

/// Reads "123.456e+7"; no sign: stamps are not negative.
std::optional<Decimal> parse_decimal(std::string_view text) {
  Decimal d;
  int significant = 0;
  bool any = false, after_point = false;
  std::size_t i = 0;
  for (; i < text.size(); ++i) {
    if (text[i] == '.' && !after_point) {
      after_point = true;
      continue;
    }
    if (!is_digit(text[i])) break;
    any = true;
    const bool kept = significant < 19;
    if (kept) d.digits = d.digits * 10 + static_cast<std::uint64_t>(text[i] - '0');
    if (kept && d.digits != 0) ++significant;
    d.exponent += (kept ? 0 : 1) - (after_point ? 1 : 0);
  }
  if (!any || text.size() > 400) return std::nullopt;
  if (i == text.size()) return d;
  if (text[i] != 'e' && text[i] != 'E') return std::nullopt;
  ++i;
  if (i < text.size() && text[i] == '+') ++i;
  int exponent = 0;
  const auto [end, error] = std::from_chars(text.data() + i, text.data() + text.size(), exponent);
  if (error != std::errc() || end != text.data() + text.size() || exponent < -1000 || exponent > 1000) return std::nullopt;
  d.exponent += exponent;
  return d;
}

}  // namespace

std::string_view trim(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const auto first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::optional<double> parse_double(std::string_view text) {
  text = trim(text);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || end != text.data() + text.size()) return std::nullopt;
  if (error != std::errc()) return std::nullopt;
  return value;
}

std::optional<Time> parse_nanoseconds(std::string_view text) {
  text = trim(text);
  std::int64_t ns = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), ns);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (ns < 0 || ns > kLatestStamp_ns) return std::nullopt;
  return Time{ns};
}

std::optional<Time> parse_seconds(std::string_view text) {
  auto decimal = parse_decimal(trim(text));
  if (!decimal) return std::nullopt;
  if (decimal->digits == 0) return Time{0};
  int shift = decimal->exponent + 9;
  std::uint64_t ns = decimal->digits;
  for (; shift > 0; --shift) {
    if (ns > static_cast<std::uint64_t>(kLatestStamp_ns) / 10) return std::nullopt;
    ns *= 10;
  }
  unsigned last_digit = 0;
  for (; shift < 0; ++shift) {
    last_digit = static_cast<unsigned>(ns % 10);
    ns /= 10;
  }
  if (last_digit >= 5) ++ns;
  if (ns > static_cast<std::uint64_t>(kLatestStamp_ns)) return std::nullopt;
  return Time{static_cast<std::int64_t>(ns)};
}

std::string format_seconds(Time t) {
  const bool negative = t.ns < 0;
  const std::uint64_t ns = negative ? 0 - static_cast<std::uint64_t>(t.ns) : static_cast<std::uint64_t>(t.ns);
  return fmt::format("{}{}.{:09}", negative ? "-" : "", ns / 1'000'000'000, ns % 1'000'000'000);
}

}  // namespace fbvins
