// SPDX-License-Identifier: Apache-2.0
// The learned booster as a stage between extraction and matching (paper 2.2.2).
// One instance is used by one thread at a time.
//
//   auto stage = make_booster_stage(BoosterOptions{});            // the weights that ship with the project
//   if (!stage) return stage.error();
//   (*stage)->improve(752, 480, features);
#pragma once

#include <memory>
#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/features/booster_options.hpp"
#include "fbvins/features/descriptor_stage.hpp"

namespace fbvins {

/// The file that the option `weights` names: a path is taken as it is; a name is looked up in the folder $FBVINS_WEIGHTS
/// where that is set, else by data_file().
std::string booster_weights_path(const std::string& weights);

Result<std::unique_ptr<DescriptorStage>> make_booster_stage(const BoosterOptions& options);

}  // namespace fbvins
