// SPDX-License-Identifier: Apache-2.0
// Options describe themselves. Every Options struct has defaults and units in its header and one
// visit(); parsing, printing (`fbvins config`), range checks and the effective configuration
// written beside a result all come from it.
//
//   struct FooOptions {
//     int max_features = 150;
//     double min_distance_px = 20;
//     template <class V>
//     void visit(V&& v) {
//       v("max_features", max_features, "", "features followed at once", 10, 5000);
//       v("min_distance_px", min_distance_px, "px", "smallest distance between features", 2.0, 200.0);
//     }
//   };
//
// Field kinds: bool, int, double (name, reference, unit, meaning, min, max), std::string (name, reference, allowed
// values separated by '|', meaning), and enum class, counted from 0 in the order of its names (name, reference,
// names separated by '|', meaning). Groups: v.group("klt", klt_options, "meaning").
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <type_traits>

#include "fbvins/core/result.hpp"

namespace fbvins {

/// Visitor that finds the first field out of its range.
class OptionsValidator {
 public:
  template <class T>
  void operator()(std::string_view name, T& value, std::string_view, std::string_view, T min, T max) {
    if (!(value >= min && value <= max)) fail(fmt::format("{}{} = {} is outside [{}, {}]", prefix_, name, value, min, max));
  }
  void operator()(std::string_view, bool&, std::string_view, std::string_view) {}
  template <class Enum>
  requires std::is_enum_v<Enum>
  void operator()(std::string_view name, Enum& value, std::string_view names, std::string_view) {
    const auto count = 1 + std::count(names.begin(), names.end(), '|');
    if (static_cast<long>(value) < 0 || static_cast<long>(value) >= count)
      fail(fmt::format("{}{} = {} is none of {}", prefix_, name, static_cast<long>(value), names));
  }
  void operator()(std::string_view name, std::string& value, std::string_view choices, std::string_view) {
    if (choices.empty()) return;
    const std::string padded = fmt::format("|{}|", choices);
    if (value.empty() || value.find('|') != std::string::npos || padded.find(fmt::format("|{}|", value)) == std::string::npos)
      fail(fmt::format("{}{} = '{}' is none of {}", prefix_, name, value, choices));
  }
  template <class Group>
  void group(std::string_view name, Group& options, std::string_view) {
    const std::string outer = prefix_;
    prefix_ += fmt::format("{}.", name);
    options.visit(*this);
    prefix_ = outer;
  }
  const std::string& error() const { return error_; }

 private:
  void fail(std::string message) {
    if (error_.empty()) error_ = std::move(message);
  }
  std::string prefix_, error_;
};

/// One sentence about the first field out of range, or success.
template <class Options>
Result<void> validate(Options options) {
  OptionsValidator validator;
  options.visit(validator);
  if (validator.error().empty()) return {};
  return Error{ErrorCode::invalid_argument, validator.error()};
}

}  // namespace fbvins
