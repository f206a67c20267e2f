// SPDX-License-Identifier: Apache-2.0
// Which frames become keyframes, and which keyframe leaves a full window (paper 2.1.2).
#pragma once

#include <vector>

#include "fbvins/estimator/estimator_options.hpp"
#include "fbvins/estimator/sliding_window.hpp"

namespace fbvins {

class KeyframePolicy {
 public:
  KeyframePolicy(const KeyframeOptions& options, double focal_px) : options_(options), focal_px_(focal_px) {}

  /// Is the newest frame far enough, in what it sees, from the last keyframe?
  bool is_keyframe(const SlidingWindow& window, const Calibration& calibration, bool standstill) const;

  /// Index of the keyframe that leaves, out of the first `keyframes` frames. `oldest`: 0.
  /// `entropy`: the one whose images tell least about the newest state (docs/derivations/entropy.md,
  /// E4). `problem` holds the window, as built.
  int leaving(const WindowProblem& problem, int keyframes);

 private:
  KeyframeOptions options_;
  double focal_px_;
  WindowProblem scratch_;
};

/// Differential entropy of the newest frame's fifteen numbers without what frame `unseen` saw; with all
/// observations for unseen = -1. In nats, up to the constant of E2.
double entropy_of_newest(const WindowProblem& problem, int unseen, WindowProblem& scratch);

}  // namespace fbvins
