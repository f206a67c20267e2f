// SPDX-License-Identifier: Apache-2.0
// A frame leaves the window (paper 2.1.2): what it, the landmarks that leave with it, and the old
// prior say about the frames that stay becomes the new prior (docs/derivations/window.md, W10-W12).
#pragma once

#include <cstdint>
#include <vector>

#include "fbvins/estimator/window_problem.hpp"

namespace fbvins {

/// The prior on the other frames once `leaving` and the flagged landmarks are gone: takes the old
/// prior, the standstill and IMU factors that touch the frame, and every observation of those
/// landmarks. Frame indices of the result still count the leaving frame. Frames named in it are
/// linearised at linearisation_point(): first estimates where they have one, else their state.
/// `scratch` lends its memory.
WindowPrior marginalise_frame(const WindowProblem& problem, int leaving, const std::vector<std::uint8_t>& landmark_leaves,
                              WindowProblem& scratch);

}  // namespace fbvins
