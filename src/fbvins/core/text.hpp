// SPDX-License-Identifier: Apache-2.0
// The parts of a text, and numbers that are all of it; no locale. Pure functions, any thread.
//
//   split("udp:127.0.0.1:14550", ':')   -> {"udp", "127.0.0.1", "14550"}
//   number_in<int>("14550")             -> 14550; none for "14550x", " 1", "+1" or ""
#pragma once

#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fbvins {

/// One more than there are separators; they may be empty.
inline std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts(1);
  for (const char c : text)
    if (c == separator) parts.emplace_back();
    else parts.back() += c;
  return parts;
}

/// May be NaN or infinite where T can and the text says so.
template <class T>
std::optional<T> number_in(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// The enumerator, up to `last`, of which to_string() is this text; none for one of another version.
template <class Enum>
std::optional<Enum> enumerator_in(std::string_view text, Enum last) {
  for (int i = 0; i <= static_cast<int>(last); ++i)
    if (to_string(static_cast<Enum>(i)) == text) return static_cast<Enum>(i);
  return std::nullopt;
}

}  // namespace fbvins
