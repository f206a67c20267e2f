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

  /// Index of the keyframe among the first `candidates` frames that leaves. `oldest`: 0.
  /// `entropy`: the one whose measurements lower the entropy of the other states least
  /// (docs/derivations/entropy.md, E1-E5). `problem` holds the window, as built.
  int leaving(const WindowProblem& problem, int candidates);

 private:
  KeyframeOptions options_;
  double focal_px_;
  WindowProblem scratch_;
};

/// Decrease of the differential entropy of the other frames' states by the visual measurements of
/// `frame`, in nats (E4).
double information_gain(const WindowProblem& problem, int frame, WindowProblem& scratch);

}  // namespace fbvins
