// SPDX-License-Identifier: Apache-2.0
// Exposure time from the motion blur that the camera's rotation leaves at edges. Method: docs/doctor.md. Pure functions,
// any thread.
//
//   const Blur blur = measure_blur(evidence, imu, rig);
//   if (auto finding = check_blur(blur)) ...
#pragma once

#include <optional>

#include "fbvins/checkup/finding.hpp"
#include "fbvins/doctor/evidence.hpp"
#include "fbvins/doctor/imu_series.hpp"

namespace fbvins {

struct Blur {
  double exposure_s = 0, sigma_s = 0;
  double speed_pxps = 0;  ///< image velocity by rotation, exceeded in a tenth of the images
  int images = 0;         ///< with enough rotation; with too few nothing is measured
  double length_px() const { return exposure_s * speed_pxps; }
};

/// `imu` in rad/s and the body's axes, `rig` with extrinsics and time offset as far as known.
Blur measure_blur(const Evidence& evidence, const ImuSeries& imu, const StereoRig& rig);
std::optional<Finding> check_blur(const Blur& blur);

}  // namespace fbvins
