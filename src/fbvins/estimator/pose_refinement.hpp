// SPDX-License-Identifier: Apache-2.0
// The body's pose from landmarks of known position (perspective-n-point with a stereo rig), by
// robust Gauss-Newton from a guess.
#pragma once

#include <vector>

#include "fbvins/estimator/reprojection.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

struct LandmarkObservation {  // a landmark of known position and its observations
  Vec3 p_G = Vec3::Zero();
  const TrackedFeature* feature = nullptr;
};

struct PoseRefinement {
  Pose<G, B> T_GB;
  int inliers = 0;         ///< points whose first observation is within 3 sigma
  bool converged = false;  ///< or stopped at max_iterations with inliers
};

/// `v_B`: the body's velocity, m/s, which counts where not all was seen at the stamp.
PoseRefinement refine_pose(const std::vector<LandmarkObservation>& observations, const Calibration& calibration, Pose<G, B> guess,
                           const Vec3& v_B = Vec3::Zero(), int max_iterations = 15);

}  // namespace fbvins
