// SPDX-License-Identifier: Apache-2.0
// Private to calibration: what a solved problem says, in the words of the result. Pure function.
#pragma once

#include "fbvins/calibration/imu_camera_collect.hpp"

namespace fbvins {

/// All but what the fit's earlier stages have measured. The problem is linearised at its minimum.
CameraImuResult make_result(ImuCameraProblem& problem, const CalibrationStart& start,
                            const std::vector<RigVariation>& variations);

}  // namespace fbvins
