// SPDX-License-Identifier: Apache-2.0
// Projection by a lens model, with all derivatives. Unlike Camera::project it takes rays up to the model's own limit, also those
// that point backwards. A pure function, any thread.
#pragma once

#include <optional>

#include "fbvins/camera/lens_models.hpp"
#include "fbvins/geometry/pose.hpp"

namespace fbvins {

inline constexpr int kMostLensParameters = 12;

struct LensDerivatives {
  Eigen::Matrix<double, 2, 3> point;                         ///< d(pixel)/d(p_C)
  Eigen::Matrix<double, 2, kMostLensParameters> parameters;  ///< d(pixel)/d(parameters); columns beyond their count are zero
};

/// Pixel of a point in the camera's frame; nullopt outside of the model's domain.
std::optional<Vec2> project_point(const LensModel& lens, const Vec3& p_C, LensDerivatives* derivatives = nullptr);

}  // namespace fbvins
