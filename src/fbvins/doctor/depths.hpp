// SPDX-License-Identifier: Apache-2.0
// Private to the doctor: evidence as another calibration has it. Pure functions, any thread.
#pragma once

#include <cstdint>
#include <set>

#include "fbvins/doctor/evidence.hpp"

namespace fbvins {

/// Depths by `rig` of the same matches whose depths the working rig told; `rig` becomes the working rig.
Evidence with_depths_by(const StereoRig& rig, Evidence evidence);

/// Without the features of these ids.
Evidence without(const std::set<std::int64_t>& ids, Evidence evidence);

}  // namespace fbvins
