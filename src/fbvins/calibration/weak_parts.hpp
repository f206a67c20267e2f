// SPDX-License-Identifier: Apache-2.0
// What a recording has left poorly determined, and what to record so that the next one determines it. Pure function, any thread.
//
//   for (const WeakPart& part : weak_parts(found, imu)) print(sentence(part));
#pragma once

#include <string>
#include <vector>

#include "fbvins/calibration/camera_calibration.hpp"
#include "fbvins/calibration/imu_camera.hpp"
#include "fbvins/core/angle.hpp"

namespace fbvins {

/// Standard deviations up to which a part counts as determined (docs/calibration.md).
struct CertaintyAims {
  double lens_px = 0.3;  ///< anywhere in the image
  double baseline_m = 1e-4, between_cameras_rad = 0.01 * kDegree;
  double lever_m = 2e-3, mounting_rad = 0.1 * kDegree, time_offset_s = 3e-4;
  double imu_axes = 2e-3, line_delay_s = 1e-6;
};

struct WeakPart {
  std::string what, unit;
  double sigma = 0, aim = 0;  ///< in `unit`
  std::string advice;         ///< what to record
};

/// Everything that is judged, determined or not: the progress of a calibration. `imu`: null without one.
std::vector<WeakPart> judged_parts(const CameraCalibration& found, const CameraImuResult* imu, const CertaintyAims& aims = {});
/// Those of them that are less certain than the aims.
std::vector<WeakPart> weak_parts(const CameraCalibration& found, const CameraImuResult* imu, const CertaintyAims& aims = {});

/// "cam0's lens at the top left is known to 0.8 px, where 0.3 px are wanted: bring the board there".
std::string sentence(const WeakPart& part);

}  // namespace fbvins
