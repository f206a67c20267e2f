// SPDX-License-Identifier: Apache-2.0
// Tables and consistency plots of a matrix: the paper's Table 1 where each recording was run once, figures by scenario
// where there are many seeds. Pure functions, any thread.
//
//   nlohmann::ordered_json payload = bench_payload("Table 1", results, {});
//   write(markdown(payload));  write(report_html({}, payload, options));
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fbvins/experiment/bench_results.hpp"

namespace fbvins {

/// {tables: [{title, note, texts, head, rows}], consistency: [{name, flights, t, position, ..., low, high}]}, which
/// report_html shows and markdown prints.
nlohmann::ordered_json bench_payload(const std::string& title, const std::vector<CellResult>& results,
                                     const std::vector<Regression>& regressions);

std::string markdown(const nlohmann::ordered_json& payload);

/// Bounds that the mean of `flights` normalised errors squared with three degrees of freedom keeps with 95 %.
struct NeesBounds {
  double low = 0, high = 0;
};
NeesBounds nees_bounds(int flights);

}  // namespace fbvins
