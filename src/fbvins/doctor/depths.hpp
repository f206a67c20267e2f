// SPDX-License-Identifier: Apache-2.0
// Private to the doctor: evidence adapted to another calibration. Pure functions, any thread.
#pragma once

#include <cstdint>
#include <set>

#include "fbvins/doctor/evidence.hpp"

namespace fbvins {

/// The same matches with their depths triangulated by `rig`, which becomes the working rig.
Evidence with_depths_by(const StereoRig& rig, Evidence evidence);

/// Without the features of these ids.
Evidence without(const std::set<std::int64_t>& ids, Evidence evidence);

}  // namespace fbvins
