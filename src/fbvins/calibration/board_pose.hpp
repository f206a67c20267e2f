// SPDX-License-Identifier: Apache-2.0
// Private: the pose of a board in one image, for a lens that is known or guessed. Pure functions, any thread.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/board_view.hpp"
#include "fbvins/calibration/camera_calibration.hpp"

namespace fbvins {

struct PosedBoard {
  Pose<Cn, T> T_CnT;
  double rms_px = 0;  ///< robust: 1.48 times the median distance of corners, over sqrt(2)
  /// The board tilted to the other side, which nearly gives the same image when it is small, and by how much its cost (half the
  /// sum of squares) is larger.
  Pose<Cn, T> other;
  double other_costs_px2 = 0;
};

/// From a homography of the rays, then by Gauss-Newton on the pixels; of the two poses that a small tilted board may have, the
/// better one. nullopt with fewer than four usable corners or corners in a line.
std::optional<PosedBoard> find_board_pose(const Camera& camera, const Board& board, const std::vector<BoardCorner>& corners);

}  // namespace fbvins
