// SPDX-License-Identifier: Apache-2.0
// The sliding window's books, part two: what is not believed any more, and what is remembered.
#include <algorithm>
#include <utility>

#include "fbvins/estimator/sliding_window.hpp"

namespace fbvins {
namespace {

/// W may have drifted since a landmark was seen, but not by more than this many times what tells it from others.
constexpr double kFarFromBelief = 5;
/// Tracks that proved wrong are remembered as such up to this many, the newest.
constexpr std::size_t kMaxBanned = 20000;

bool seen_in(const Landmark& landmark, FrameId frame) {
  return std::any_of(landmark.sightings.begin(), landmark.sightings.end(), [&](const Sighting& s) { return s.frame == frame; });
}

}  // namespace

int SlidingWindow::remove_outliers(const WindowProblem& problem, double threshold_sigma) {
  int removed = 0;
  std::vector<std::uint8_t> gone(landmarks_.size(), 0);
  for (std::size_t i = 0; i < problem.landmarks.size(); ++i) {
    Landmark& landmark = landmarks_[landmark_of_problem_[i]];
    const WindowLandmark& numbers = problem.landmarks[i];
    int k = numbers.first_observation;
    std::vector<Sighting> kept;
    bool struck = false;
    for (Sighting& s : landmark.sightings) {
      const bool left_bad = problem.residual(numbers, problem.observations[k++]).norm() > threshold_sigma;
      const bool right_bad = s.right && problem.residual(numbers, problem.observations[k++]).norm() > threshold_sigma;
      removed += left_bad + right_bad;
      struck |= left_bad || right_bad;
      if (right_bad) s.right.reset();
      if (!left_bad) kept.push_back(s);
    }
    if (!struck) continue;
    landmark.strikes += 1;
    landmark.sightings = std::move(kept);
    const bool too_near = numbers.alpha_beta_rho.z() > 1.0 / options_.min_depth_m;
    if (landmark.sightings.size() < 2 || landmark.strikes >= kStrikesUntilBanned || too_near) {
      gone[landmark_of_problem_[i]] = 1;
      banned_[landmark.track] = landmark.strikes;
      if (banned_.size() > kMaxBanned) banned_.erase(banned_.begin());
    } else if (landmark.sightings.front().frame != landmark.host && !seen_in(landmark, landmark.host)) {
      rehost(landmark, landmark.sightings.front().frame, problem.calibration);
    }
  }
  remove_flagged(gone);
  return removed;
}

void SlidingWindow::remove_flagged(const std::vector<std::uint8_t>& remove) {
  std::size_t out = 0;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    if (remove[i]) {
      landmark_of_track_.erase(landmarks_[i].track);
      continue;
    }
    if (out != i) {
      landmark_of_track_[landmarks_[i].track] = static_cast<int>(out);
      landmarks_[out] = std::move(landmarks_[i]);
    }
    ++out;
  }
  landmarks_.resize(out);
}

int SlidingWindow::refuse_beliefs(const WindowProblem& problem) {
  int refused = 0;
  for (std::size_t i = 0; i < problem.landmarks.size(); ++i) {
    const WindowLandmark& numbers = problem.landmarks[i];
    if (numbers.belief < 0 || problem.distance_to_belief(numbers).norm() <= options_.known_landmarks.outlier_sigma) continue;
    disbelieve(landmarks_[landmark_of_problem_[i]]);
    ++refused;
  }
  return refused;
}

/// One that is nowhere near is another one, and would spoil the whole solve.
void SlidingWindow::refuse_distant_belief(Landmark& landmark, const Calibration& calibration) {
  const WindowLandmark numbers{.alpha_beta_rho = landmark.alpha_beta_rho};
  const Pose<W, B>& host = frames_[index_of(landmark.host)].state.T_WB;
  const double distance_sigma = belief_residual(CameraGeometry(calibration), host, numbers, *landmark.belief).norm();
  if (distance_sigma < kFarFromBelief * options_.known_landmarks.outlier_sigma) return;
  disbelieve(landmark);
}

void SlidingWindow::disbelieve(Landmark& landmark) {
  landmark.belief.reset();
  known_.forget(landmark.track);
}

/// Of those still in view the position now found holds what comes: they are known again at once.
void SlidingWindow::remember_leaving(const WindowProblem& problem, const std::vector<std::uint8_t>& leaves,
                                     const Calibration& calibration) {
  const std::vector<PointBlock>& points = marginalisation_scratch_.points().points();  // of the leaving, in order
  auto point = points.begin();
  for (std::size_t i = 0; i < problem.landmarks.size(); ++i) {
    if (!leaves[i]) continue;
    const WindowLandmark& numbers = problem.landmarks[i];
    Landmark& landmark = landmarks_[landmark_of_problem_[i]];
    known_.remember(landmark.track, frames_[numbers.host].state.T_WB * calibration.T_BC0, numbers.alpha_beta_rho, point++->V);
    landmark.belief = known_.find(landmark.track);
  }
}

}  // namespace fbvins
