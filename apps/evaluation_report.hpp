// SPDX-License-Identifier: Apache-2.0
// An evaluation as text for people and as JSON for programs.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "fbvins/eval/coverage.hpp"
#include "fbvins/eval/evaluation.hpp"
#include "fbvins/eval/nees.hpp"

namespace fbvins::app {

using Json = nlohmann::ordered_json;

Json to_json(const ErrorStatistics& statistics);
Json to_json(const Evaluation& evaluation, Alignment alignment);
Json to_json(const Coverage& coverage);
Json to_json(const NeesSummary& nees);

/// The paper's Table 1: Max, Mean, Median, RMSE, Std; then the relative errors in the same columns.
std::string to_table(const Evaluation& evaluation, Alignment alignment);
std::string to_line(const Coverage& coverage);

}  // namespace fbvins::app
