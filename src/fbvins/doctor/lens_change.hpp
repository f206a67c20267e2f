// SPDX-License-Identifier: Apache-2.0
// A camera with a slightly different calibration. Pure functions, any thread.
#pragma once

#include "fbvins/camera/camera.hpp"

namespace fbvins {

/// Whose lens; both change alike where the calibration is of another image size, or is missing.
enum class WhichLens { left, right, both };

struct LensChange {
  double log_focal = 0;           ///< fx and fy are multiplied by its exponential
  Vec2 centre_px = Vec2::Zero();  ///< added to the principal point
  Vec2 radial = Vec2::Zero();     ///< added to the two parameters of RadialNames
};

/// Names of the two parameters with the largest radial effect.
struct RadialNames {
  const char* first;
  const char* second;
};
RadialNames radial_names(const Camera& camera);

Camera changed(const Camera& camera, const LensChange& change);

/// Whether its own parameters are in the range in which its model is defined.
bool in_range(const Camera& camera);

}  // namespace fbvins
