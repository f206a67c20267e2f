// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/keyframe_policy.hpp"

#include <Eigen/Cholesky>

namespace fbvins {
namespace {

/// ln det of a symmetric positive (semi-)definite matrix; directions without information count nothing.
double log_determinant(const Eigen::MatrixXd& m) {
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(m);
  double sum = 0;
  for (const double d : ldlt.vectorD())
    if (d > 1e-9) sum += std::log(d);
  return sum;
}

/// Information on all frames but one, that one marginalised out.
Eigen::MatrixXd information_without(WindowProblem& problem, int frame) {
  problem.linearise();
  const Eigen::MatrixXd information = problem.reduced_information();
  std::vector<int> keep, drop;
  for (int i = 0; i < static_cast<int>(problem.frames.size()); ++i)
    for (int k = 0; k < 15; ++k) (i == frame ? drop : keep).push_back(problem.row_of(i, k));
  return marginalise(information, problem.reduced_gradient(), keep, drop).H;
}

}  // namespace

bool KeyframePolicy::is_keyframe(const SlidingWindow& window, const Calibration& calibration, bool standstill) const {
  const SlidingWindow::KeyframeDistance d = window.distance_to_last_keyframe(calibration, focal_px_);
  if (standstill) return false;
  return d.shared_ratio < options_.min_shared_ratio || d.parallax_px > options_.min_parallax_px ||
         d.age.seconds() > options_.max_interval_s;
}

double information_gain(const WindowProblem& problem, int frame, WindowProblem& scratch) {
  scratch = problem;
  const double with = log_determinant(information_without(scratch, frame));
  // The same without what this frame saw.
  scratch.observations.clear();
  for (WindowLandmark& l : scratch.landmarks) {
    const int first = static_cast<int>(scratch.observations.size());
    for (int k = 0; k < l.observation_count; ++k) {
      const WindowObservation& o = problem.observations[l.first_observation + k];
      if (o.frame != frame) scratch.observations.push_back(o);
    }
    l.first_observation = first;
    l.observation_count = static_cast<int>(scratch.observations.size()) - first;
  }
  // A landmark with fewer than two rays left says nothing: it would only make the elimination singular.
  std::erase_if(scratch.landmarks, [](const WindowLandmark& l) { return l.observation_count < 2; });
  const double without = log_determinant(information_without(scratch, frame));
  return 0.5 * (with - without);
}

int KeyframePolicy::leaving(const WindowProblem& problem, int candidates) {
  if (options_.leaving == "oldest") return 0;
  int least = 0;
  double least_gain = 0;
  for (int i = 0; i < candidates; ++i) {
    const double gain = information_gain(problem, i, scratch_);
    if (i == 0 || gain < least_gain) {
      least = i;
      least_gain = gain;
    }
  }
  return least;
}

}  // namespace fbvins
