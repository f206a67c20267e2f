// SPDX-License-Identifier: Apache-2.0
// How far from where a pose expects them each camera sees the landmarks, and which camera is off alone. Pure functions.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "fbvins/estimator/pose_refinement.hpp"

namespace fbvins {

/// Medians over a camera's landmarks, in standard deviations of a feature.
struct ResidualMedians {
  std::array<std::optional<double>, kMostCameras> norm;  ///< of the residuals' norms; none with few landmarks
  std::array<Vec2, kMostCameras> shift;                  ///< of the residuals themselves
  double focal = 0;                                      ///< standard deviations for a radian

  bool of(int camera) const { return norm[static_cast<std::size_t>(camera)].has_value(); }
  double worst() const;
};

/// `v_B`: velocity, which counts where not all was seen at the stamp.
ResidualMedians camera_residuals(const std::vector<LandmarkObservation>& observations, const Calibration& calibration,
                                 const Pose<G, B>& T_GB, const Vec3& v_B);

/// Cameras as in Health::without_cameras: the one that is off most, if the others are not, or else it and those that see the same
/// things, if the others are not. None where that is not so. `off`: by how much each camera is; `limit(off)`: below it the others
/// are not, where the worst one is off by as much.
std::uint8_t camera_off_alone(const std::vector<LandmarkObservation>& observations, const ResidualMedians& at,
                              const std::vector<double>& off, const std::function<double(double)>& limit);

}  // namespace fbvins
