// SPDX-License-Identifier: Apache-2.0
// Private to calibration: a first path through the poses seen, with the gyroscope between them (docs/derivations/calibration.md,
// A6). Pure functions.
#pragma once

#include <vector>

#include "fbvins/calibration/imu_camera_problem.hpp"
#include "fbvins/calibration/imu_camera_start.hpp"

namespace fbvins {

struct BodyPose {
  double t_s = 0;  ///< IMU's clock, since the path's start
  Pose<T, B> T_TB;
};

/// Those whose orientation is what the gyroscope makes of the others within seconds: a board seen in part has a second pose,
/// tilted the other way, which may fit an image better. Both by time.
std::vector<BodyPose> agreeing_with_gyro(const std::vector<BodyPose>& poses, const std::vector<CalibrationReading>& readings,
                                         const Vec3& gyro_bias_radps);

/// Knots from time 0 to at least `duration_s`. `poses` by time, at least one.
PoseSpline first_path(const std::vector<BodyPose>& poses, const std::vector<CalibrationReading>& readings,
                      const Vec3& gyro_bias_radps, double spacing_s, double duration_s);

/// The same path with knots closer together.
PoseSpline with_spacing(const PoseSpline& path, double spacing_s);

}  // namespace fbvins
