// SPDX-License-Identifier: Apache-2.0
// A source by its name, as `fbvins live --source` has it.
//
//   Result<std::unique_ptr<Source>> source = make_source("replay:MH_01_easy");
#pragma once

#include <memory>
#include <string>

#include "fbvins/io/dataset.hpp"
#include "fbvins/live/source.hpp"

namespace fbvins {

/// What may be said of a source beside its name.
struct SourceOptions {
  DatasetOptions dataset;  ///< of a replay
};

/// KIND:WHERE. replay:DATASET[@SPEED] plays a recording in wall time.
Result<std::unique_ptr<Source>> make_source(const std::string& name, const SourceOptions& options = {});

}  // namespace fbvins
