// SPDX-License-Identifier: Apache-2.0
// Numbers of text files: no locale, no loss of nanoseconds, the whole field or nothing.
// Pure functions, any thread.
//
//   parse_nanoseconds("1403636584763555584")   -> Time{1403636584763555584}
//   parse_seconds("1.403636584763555584e+09")  -> the same instant, digit by digit
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "fbvins/core/time.hpp"

namespace fbvins {

/// Stamps beyond this (the year 2096) are damage; the room above keeps sums of stamps from overflowing.
inline constexpr std::int64_t kLatestStamp_ns = 4'000'000'000'000'000'000;

std::string_view trim(std::string_view text);

/// May be NaN or infinite when the text says so.
std::optional<double> parse_double(std::string_view text);
/// Integer nanoseconds from 0 to kLatestStamp_ns.
std::optional<Time> parse_nanoseconds(std::string_view text);
/// Decimal seconds, also with an exponent, rounded to the nearest nanosecond without passing
/// through a double (which would lose about 100 ns of a present-day stamp).
std::optional<Time> parse_seconds(std::string_view text);

/// Seconds with nine decimals, exact.
std::string format_seconds(Time t);

}  // namespace fbvins
