// SPDX-License-Identifier: Apache-2.0
// Time offset, line delay and mounting of a camera that measures no depth, by the same solver as in flight
// (imu/gyro_alignment.hpp). Pure function, any thread.
//
//   if (const auto fit = fit_gyro(evidence.frames, imu, rig, turns.offset_s)) use(fit->offset_s, fit->line_delay_s, fit->R_CB);
#pragma once

#include <optional>
#include <span>

#include "fbvins/doctor/evidence.hpp"
#include "fbvins/doctor/imu_series.hpp"

namespace fbvins {

struct GyroFit {
  double offset_s = 0, offset_sigma_s = 0;          ///< t_imu = t_image + offset, of the middle row
  double line_delay_s = 0, line_delay_sigma_s = 0;  ///< in all
  Mat3 R_CB = Mat3::Identity();
  Vec3 rotation_sigma_rad = Vec3::Zero();  ///< in the body's axes
};

/// `offset_s`: as known by rotations, to 0.1 s. None where too few images can be compared.
std::optional<GyroFit> fit_gyro(std::span<const SeenFrame> frames, const ImuSeries& imu, const StereoRig& rig, double offset_s);

}  // namespace fbvins
