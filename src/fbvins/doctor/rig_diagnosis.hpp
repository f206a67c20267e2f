// SPDX-License-Identifier: Apache-2.0
// The doctor on a rig of more than two cameras: each pair of it is examined, and each camera without a partner, then how those
// that overlap stand to one another, and what was found is told with the numbers of its cameras. Pure functions.
#pragma once

#include "fbvins/camera/camera_groups.hpp"
#include "fbvins/doctor/diagnose.hpp"

namespace fbvins {

/// The images of a group's cameras as left and right, at the instant of the left one; none where neither has one.
std::optional<StereoFrame> frame_of_group(const StereoFrame& frame, const CameraGroup& group);

/// Adds what was found with a group's cameras to the diagnosis of their rig. `first`: nothing was added before; of further groups
/// what concerns the IMU or the clocks, which is known already, is left out.
void add_group(const Diagnosis& found, const CameraGroup& group, bool first, Diagnosis& all);

/// Of each two of the rig's groups the two cameras that share most of their view, if that is a third of an image.
std::vector<CameraGroup> pairs_across(const StereoRig& rig);

/// Adds of two cameras of different groups only what their epipolar lines say of how they stand to each other. No calibration is
/// proposed: each of them has its place in its own pair.
void add_across(const Diagnosis& found, const CameraGroup& pair, Diagnosis& all);

}  // namespace fbvins
