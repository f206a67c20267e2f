// SPDX-License-Identifier: Apache-2.0
// A frame leaves the window (paper 2.1.2): the information that it, the landmarks that leave with it, and the old
// prior have on the frames that stay becomes the new prior (docs/derivations/window.md, W10-W12).
#pragma once

#include <span>
#include <vector>

#include "fbvins/estimator/window_equations.hpp"

namespace fbvins {

/// A landmark of a problem that leaves with a frame.
struct LeavingLandmark {
  int index = 0;         ///< into WindowProblem::landmarks
  int observations = 0;  ///< number of its observations, the oldest, that go into the prior
  bool in_view = false;  ///< whether the newest frame sees it
};

/// The landmarks that leave with keyframe `leaving`: those it hosts. One still in view gives only its observations before frame
/// `newest_begin` to the prior, and starts anew from the rest: no observation is used twice. In the problem's order.
std::vector<LeavingLandmark> landmarks_leaving_with(const WindowProblem& problem, int leaving, int newest_begin);

struct Marginalised {
  WindowPrior prior;                       ///< its frame indices still count the leaving frame
  std::vector<Mat3> landmark_information;  ///< of (alpha, beta, rho) given the poses, one for each leaving landmark
};

/// Working memory.
struct MarginalisationMemory {
  WindowProblem factors;
  PairTable pairs;
  NormalEquations equations;
};

/// The prior on the other frames after `leaving` and the landmarks are eliminated from the old prior, the factors
/// of the frame, and those landmarks' observations. Frames named in it are linearised at
/// linearisation_point(): first estimates where they have one, else their state.
Marginalised marginalise_frame(const WindowProblem& problem, int leaving, std::span<const LeavingLandmark> landmarks,
                               MarginalisationMemory& memory);

}  // namespace fbvins
