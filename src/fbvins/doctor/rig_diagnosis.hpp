// SPDX-License-Identifier: Apache-2.0
// The doctor on a rig of more than two cameras: each pair of it is examined, and what was found is told with the numbers of its
// cameras. Pure functions.
#pragma once

#include "fbvins/camera/camera_groups.hpp"
#include "fbvins/doctor/diagnose.hpp"

namespace fbvins {

/// The images of a pair's cameras as left and right, at the instant of the left one; none where neither has one.
std::optional<StereoFrame> frame_of_pair(const StereoFrame& frame, const CameraGroup& pair);

/// Adds what was found with a pair's cameras to the diagnosis of their rig. `first`: nothing was added before; of further pairs
/// what concerns the IMU or the clocks, which is known already, is left out.
void add_pair(const Diagnosis& of_pair, const CameraGroup& pair, bool first, Diagnosis& all);

}  // namespace fbvins
