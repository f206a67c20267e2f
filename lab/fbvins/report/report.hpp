// SPDX-License-Identifier: Apache-2.0
// Runs as one self-contained HTML page: its script plots the numbers that it contains; it fetches nothing.
// Pure function, any thread.
//
//   std::string html = report_html(runs, {.title = "MH_01, klt and orb"});
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/report/run_folder.hpp"

namespace fbvins {

struct ReportOptions {
  std::string title = "FB-VINS report";
  std::size_t max_points = 1500;  ///< of a curve; longer runs are decimated
};

/// `bench`: results of a matrix (bench_payload of bench_tables.hpp), or null.
std::string report_html(const std::vector<RunFolder>& runs, const nlohmann::ordered_json& bench, const ReportOptions& options);

/// Writes the page of runs in the folders that `fbvins run` wrote. `truth`: of all of them, where they have none; empty: their
/// own. Without a title it is that of the recordings. Returns warnings.
Result<std::vector<std::string>> write_report(const std::vector<std::string>& folders, const std::string& out,
                                              const std::string& truth = "", const std::string& title = "");

}  // namespace fbvins
