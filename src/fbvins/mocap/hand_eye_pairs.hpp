// SPDX-License-Identifier: Apache-2.0
// Private to mocap: poses of the estimate with those of the markers at the same instant, and a first, rough calibration that
// is robust to flips and swaps. Pure functions, any thread.
#pragma once

#include <vector>

#include "fbvins/mocap/hand_eye.hpp"
#include "fbvins/mocap/marker_curve.hpp"

namespace fbvins {

struct HandEyePair {
  Time t;  ///< by the estimate's clock
  Pose<W, B> T_WB;
  /// From the estimate, which is smoother than the markers: noise in the Jacobian by the clock's offset would count as
  /// information.
  Vec3 v_WB = Vec3::Zero(), w_WB_B = Vec3::Zero();
  Pose<V, K> T_VK;
};

/// At those of the estimate's poses that have neighbours and markers around them.
std::vector<HandEyePair> pair_up(const MarkerCurve& curve, const Trajectory<W>& estimate, const MarkerCalibration& clocks);

/// From pairs whose clocks agree to some milliseconds. An error where no rotation fits half of the pairs.
Result<MarkerCalibration> start_hand_eye(const std::vector<HandEyePair>& pairs, const MarkerCalibration& clocks,
                                         bool level_world);

/// Residual of a pair (H2): of positions in W, m; of rotations about axes of W, rad.
Vec6 residual_of(const HandEyePair& pair, const MarkerCalibration& calibration);

}  // namespace fbvins
