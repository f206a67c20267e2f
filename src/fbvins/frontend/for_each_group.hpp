// SPDX-License-Identifier: Apache-2.0
// One frontend for a rig of any number of cameras, of those that lead (track_transfer.hpp).
//
//   for_each_group(rig, 150, [](const StereoRig& r) { return std::make_unique<KltFrontend>(r, options); });
#pragma once

#include <functional>
#include <memory>

#include "fbvins/frontend/track_transfer.hpp"

namespace fbvins {

/// `lead(cameras)`: the frontend for a rig whose left camera leads; with a pair whose right one does not lead anyway, either of
/// its cameras can. Each group of cameras has its own. `max_features`: of a rig of one group.
std::unique_ptr<Frontend> for_each_group(const StereoRig& rig, int max_features,
                                         const std::function<std::unique_ptr<LeadingFrontend>(const StereoRig&)>& lead);

}  // namespace fbvins
