// SPDX-License-Identifier: Apache-2.0
// What `fbvins info` says of a recording, as JSON.
#pragma once

#include "apps/evaluation_report.hpp"
#include "fbvins/bags/bag_survey.hpp"
#include "fbvins/io/dataset.hpp"

namespace fbvins::app {

Json describe(const Dataset& data);
/// Of a bag that cannot be run yet.
Json describe(const BagSurvey& bag);

}  // namespace fbvins::app
