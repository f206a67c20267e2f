// SPDX-License-Identifier: Apache-2.0
// First stage of the alignment: gyro bias and smoothed orientations (alignment.md, eq. A6-A10).
#pragma once

#include <vector>

#include "fbvins/imu/alignment.hpp"

namespace fbvins {

struct RotationAlignment {
  bool solved = false;
  Vec3 gyro_bias_radps = Vec3::Zero();
  double gyro_bias_sigma_radps = 0;  ///< worst axis
  double rms = 0;                    ///< residual in sigmas
  std::vector<Quat> R_VB;            ///< visual orientations, corrected by the gyro
  std::vector<double> sigma_rad;     ///< standard deviation of R_VB, worst axis, one per pose
};

/// Gauss-Newton on the gyro bias and small corrections of all orientations; repropagates `between`.
RotationAlignment align_rotations(const std::vector<Pose<VisualWorld, B>>& poses, std::vector<Preintegration>& between,
                                  const AlignmentOptions& options);

}  // namespace fbvins
