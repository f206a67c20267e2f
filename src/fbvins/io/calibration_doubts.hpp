// SPDX-License-Identifier: Apache-2.0
// Private: what of a calibration is possible and hardly true. A pure function, any thread.
#pragma once

#include <string>
#include <vector>

#include "fbvins/camera/camera.hpp"

namespace fbvins {

/// A sentence each: time offsets and line delays as of another unit, noise figures as of another unit, or of the other sensor.
std::vector<std::string> calibration_doubts(const StereoRig& rig);

}  // namespace fbvins
