// SPDX-License-Identifier: Apache-2.0
// JSON text, and curves as such. Private; one owner.
//
//   Curves curves(t.size(), 1500);
//   curves.add("t", t);
//   std::string json = curves.text();      // {"t":[0,0.05,...]}
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {

/// A curve as JSON text with five digits: a tenth of a general writer's size.
inline std::string curve(const std::vector<double>& values, std::size_t step) {
  std::string text = "[";
  for (std::size_t i = 0; i < values.size(); i += step) {
    if (i > 0) text += ',';
    text += std::isfinite(values[i]) ? fmt::format("{:.5g}", values[i]) : "null";
  }
  return text + "]";
}

/// Bytes that are no UTF-8, as in the name of a file, are replaced.
inline std::string json_text(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

/// A JSON object of curves with a common time axis and a common decimation.
class Curves {
 public:
  Curves(std::size_t length, std::size_t max_points) : step_(std::max<std::size_t>(1, (length + max_points - 1) / max_points)) {}

  void add(const std::string& name, const std::vector<double>& values) {
    if (!values.empty()) text_ += fmt::format("{}\"{}\":{}", text_.empty() ? "" : ",", name, curve(values, step_));
  }
  void add(const std::string& name, const std::vector<Vec3>& values) {
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> one;
      one.reserve(values.size());
      for (const Vec3& v : values) one.push_back(v[axis]);
      add(fmt::format("{}_{}", name, "xyz"[axis]), one);
    }
  }
  std::string text() const { return fmt::format("{{{}}}", text_); }

 private:
  std::size_t step_;
  std::string text_;
};

}  // namespace fbvins
