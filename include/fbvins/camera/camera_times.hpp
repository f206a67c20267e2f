// SPDX-License-Identifier: Apache-2.0
// Cameras of one rig that do not have the same time offset from the IMU, or the same line delay. Frames carry the stamps of the
// cameras' drivers, as they are recorded; the system adds what the calibration says of each camera (own_offsets), and so
// everything behind it knows when each image was taken.
//
//   rig = with_times(rig, {{.time_offset_s = 0.004}, {.time_offset_s = 0.009, .line_delay_s = 40e-6}});
//   frame.offsets += own_offsets(rig);
//
// Pure functions, any thread.
#pragma once

#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// The rig with these times, of each of its cameras.
StereoRig with_times(StereoRig rig, const std::vector<CameraTimes>& times);

/// How much later than its stamp says each camera takes its images, compared with camera 0; nothing where all are alike. To be
/// added to the offsets of stamps.
ExposureOffsets own_offsets(const StereoRig& rig);

/// Whether a camera has a line delay.
bool has_rolling_shutter(const StereoRig& rig);

}  // namespace fbvins
