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

/// The file that `weights` means: a path as it is, a name in the folder of FBVINS_WEIGHTS, where the project was
/// installed, or in its sources.
std::string booster_weights_path(const std::string& weights);

Result<std::unique_ptr<DescriptorStage>> make_booster_stage(const BoosterOptions& options);

}  // namespace fbvins
