// SPDX-License-Identifier: Apache-2.0
// Tables and consistency plots of a matrix: as the paper's Table 1 if each recording was run once, by scenario if there
// are several seeds. Pure functions, any thread.
//
//   nlohmann::ordered_json payload = bench_payload("Table 1", results, {});
//   write(markdown(payload));  write(report_html({}, payload, options));
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fbvins/experiment/bench_results.hpp"

namespace fbvins {

/// {tables: [{title, note, texts, head, rows}], consistency: [{name, flights, t, position, ..., low, high}]}, the input
/// of report_html and markdown.
nlohmann::ordered_json bench_payload(const std::string& title, const std::vector<CellResult>& results,
                                     const std::vector<Regression>& regressions);

std::string markdown(const nlohmann::ordered_json& payload);

/// Two-sided 95 % bounds of the mean NEES of `flights` flights, three degrees of freedom each.
struct NeesBounds {
  double low = 0, high = 0;
};
NeesBounds nees_bounds(int flights);

}  // namespace fbvins
