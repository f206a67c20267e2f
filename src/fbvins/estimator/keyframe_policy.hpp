// SPDX-License-Identifier: Apache-2.0
// Which frames become keyframes, when they are final, and which keyframe leaves a full window (paper 2.1.2).
#pragma once

#include <vector>

#include "fbvins/estimator/estimator_options.hpp"
#include "fbvins/estimator/sliding_window.hpp"
#include "fbvins/estimator/window_solver.hpp"
#include "fbvins/types/keyframe.hpp"

namespace fbvins {

class KeyframePolicy {
 public:
  KeyframePolicy(const KeyframeOptions& options, double focal_px) : options_(options), focal_px_(focal_px) {}

  /// Is the newest frame far enough, in what it sees, from the last keyframe?
  bool is_keyframe(const SlidingWindow& window, const Calibration& calibration, bool standstill) const;

  /// The keyframes that have left the newest frames of the window, each once, with their images, which the window gives up;
  /// without scale_sigma and reset_counter.
  std::vector<Keyframe> take_final(SlidingWindow& window, const WindowSolution& solution, const Calibration& calibration);

  /// Drops the frames that have left the newest ones and are no keyframes, and marginalises the keyframes that are too many.
  void shrink(SlidingWindow& window, const WindowSolution& solution, const Calibration& calibration);

  /// Index of the keyframe that leaves, out of the first `keyframes` frames. `oldest`: 0.
  /// `entropy`: the one with the least information on the newest state (docs/derivations/window.md, E4).
  int leaving(const SlidingWindow& window, const Calibration& calibration, int keyframes);

 private:
  /// The frames before this index have left the newest ones.
  int zone(const SlidingWindow& window) const { return window.frames().size() - options_.newest_frames; }

  KeyframeOptions options_;
  double focal_px_;
  FrameId newest_final_;
  WindowSolver solver_;
};

/// Index of the keyframe whose observations have the least information on the newest state (E4).
int least_informative_keyframe(const WindowProblem& problem, int keyframes, WindowSolver& solver);

/// Differential entropy of the newest frame's fifteen numbers without the observations of frame `unseen`; with all
/// observations for unseen = -1. In nats, up to the constant of E2; 0 where the window cannot be solved.
double entropy_of_newest(const WindowProblem& problem, int unseen, WindowSolver& solver);

}  // namespace fbvins
