// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/keyframe_policy.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

/// Keyframes this new have not been seen by enough later frames to show what they are worth.
constexpr int kTooNewToJudge = 2;

}  // namespace

bool KeyframePolicy::is_keyframe(const SlidingWindow& window, const Calibration& calibration, bool standstill) const {
  const SlidingWindow::KeyframeDistance d = window.distance_to_last_keyframe(calibration, focal_px_);
  if (standstill) return false;
  return d.shared_ratio < options_.min_shared_ratio || d.parallax_px > options_.min_parallax_px ||
         d.age.seconds() > options_.max_interval_s;
}

double entropy_of_newest(const WindowProblem& problem, int unseen, WindowProblem& scratch) {
  scratch = problem;
  scratch.observations.clear();
  for (WindowLandmark& l : scratch.landmarks) {
    const int first = static_cast<int>(scratch.observations.size());
    for (int k = 0; k < l.observation_count; ++k) {
      const WindowObservation& o = problem.observations[l.first_observation + k];
      if (o.frame != unseen) scratch.observations.push_back(o);
    }
    l.first_observation = first;
    l.observation_count = static_cast<int>(scratch.observations.size()) - first;
  }
  // A landmark with fewer than two rays left says nothing: it would only make the elimination singular.
  std::erase_if(scratch.landmarks, [](const WindowLandmark& l) { return l.observation_count < 2; });
  scratch.linearise();
  Mat17 covariance;
  if (!scratch.solve(0) || !scratch.covariance(static_cast<int>(scratch.frames.size()) - 1, covariance)) return 0;
  const Eigen::LLT<Mat15> llt(covariance.topLeftCorner<15, 15>());
  return llt.matrixLLT().diagonal().array().log().sum();  // ln det(covariance) / 2
}

int KeyframePolicy::leaving(const WindowProblem& problem, int keyframes) {
  if (options_.leaving == "oldest") return 0;
  // The entropy with everything seen is the same for all: the smallest gain is the smallest entropy without.
  int least = 0;
  double least_entropy = 0;
  for (int i = 0; i < std::max(1, keyframes - kTooNewToJudge); ++i) {
    const double entropy = entropy_of_newest(problem, i, scratch_);
    if (i > 0 && entropy >= least_entropy) continue;
    least = i;
    least_entropy = entropy;
  }
  return least;
}

}  // namespace fbvins
