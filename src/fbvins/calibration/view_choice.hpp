// SPDX-License-Identifier: Apache-2.0
// Private: which views to use when there are more than an adjustment needs. Pure functions, any thread.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/board_view.hpp"

namespace fbvins {

/// Up to `count` views of one camera that differ most in place, size, tilt and direction of tilt, in the order in which they
/// were taken up. Needs no calibration.
std::vector<BoardView> spread_views(const std::vector<BoardView>& views, const Board& board, double width_px, int count);

/// Up to `count` summands that make the determinant of their sum large, one after the other; indices, increasing.
std::vector<int> most_informative(const std::vector<Eigen::MatrixXd>& information, int count);

}  // namespace fbvins
