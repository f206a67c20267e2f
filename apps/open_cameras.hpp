// SPDX-License-Identifier: Apache-2.0
// Opens recordings of cameras that are not calibrated yet.
#pragma once

#include <string>
#include <vector>

#include "fbvins/io/camera_recording.hpp"

namespace fbvins::app {

/// A folder or zip in EuRoC's layout, a flight record or a bag. `topics`: of a bag's cameras and IMU; empty: found.
Result<CameraRecording> open_cameras(const std::string& path, const std::vector<std::string>& topics);

}  // namespace fbvins::app
