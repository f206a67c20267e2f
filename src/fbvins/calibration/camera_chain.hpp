// SPDX-License-Identifier: Apache-2.0
// Private: views of several cameras joined by stamp, and the cameras' extrinsics from the boards they see together. Pure
// functions.
#pragma once

#include <vector>

#include "fbvins/calibration/board_pose.hpp"
#include "fbvins/calibration/rig_adjustment.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

struct PosedView {
  BoardView view;
  Pose<Cn, T> T_CnT;
};

/// Views of different cameras whose stamps differ by at most `tolerance_s` from the first of them, by time.
std::vector<std::vector<PosedView>> joined_by_stamp(std::vector<PosedView> views, double tolerance_s);

/// T_CnC0 of each camera, through as many common views as there are. An error where cameras are not connected by such views.
Result<std::vector<Pose<Cn, C0>>> chain_cameras(const std::vector<std::vector<PosedView>>& stamps, int cameras);

/// Frames for the adjustment: the board's pose is that of the camera with the most corners.
std::vector<RigFrame> rig_frames(const std::vector<std::vector<PosedView>>& stamps, const std::vector<Pose<Cn, C0>>& T_CnC0,
                                 const Board& board);

}  // namespace fbvins
