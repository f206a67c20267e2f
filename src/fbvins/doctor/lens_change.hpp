// SPDX-License-Identifier: Apache-2.0
// A camera whose calibration is a little otherwise. Pure functions, any thread.
#pragma once

#include "fbvins/camera/camera.hpp"

namespace fbvins {

/// Whose lens: both change alike where a calibration was made at another size, or was left out.
enum class WhichLens { left, right, both };

struct LensChange {
  double log_focal = 0;           ///< fx and fy times its exponential
  Vec2 centre_px = Vec2::Zero();  ///< added to the principal point
  Vec2 radial = Vec2::Zero();     ///< added to the two numbers of RadialNames
};

/// The two numbers of a lens that bend its rays most.
struct RadialNames {
  const char* first;
  const char* second;
};
RadialNames radial_names(const Camera& camera);

Camera changed(const Camera& camera, const LensChange& change);

}  // namespace fbvins
