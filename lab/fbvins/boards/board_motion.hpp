// SPDX-License-Identifier: Apache-2.0
// A rig held by hand before a board that hangs on a wall. Pure functions, any thread.
#pragma once

#include <cstdint>

#include "fbvins/calibration/board.hpp"
#include "fbvins/sim/spline.hpp"

namespace fbvins {

/// The board in W: x to the right, y up, its centre at the height of the eyes.
Pose<W, T> hanging_board(const Board& board);

/// Which of its movements the hand makes.
struct HandMotion {
  bool distance = true, across = true, up = true, aim = true, roll = true;
};

/// Nearer and farther, to all sides, turned about all axes, the board now in the middle and now at the rim of cam0's image.
/// `focal_ratio`: focal length over the image's width, to which the distance belongs.
SplineTrajectory hand_before_board(const Board& board, double focal_ratio, const Pose<B, C0>& T_BC0, double duration_s,
                                   std::uint64_t seed, const HandMotion& motion = {});

}  // namespace fbvins
