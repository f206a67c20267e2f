// SPDX-License-Identifier: Apache-2.0
// How long the images were exposed, by what the camera's turning does to their edges. Method: docs/doctor.md. Pure functions,
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
  double speed_pxps = 0;  ///< by turning, exceeded in a tenth of the images
  int images = 0;         ///< that turned enough; with too few nothing is measured
  double length_px() const { return exposure_s * speed_pxps; }
};

/// `imu` in rad/s and the body's axes, `rig` with mounting and time offset as far as known.
Blur measure_blur(const Evidence& evidence, const ImuSeries& imu, const StereoRig& rig);
std::optional<Finding> check_blur(const Blur& blur);

}  // namespace fbvins
