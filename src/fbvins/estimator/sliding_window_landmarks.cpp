// SPDX-License-Identifier: Apache-2.0
// The sliding window's books, part two: observations and priors that are refused, landmarks that are remembered.
#include <algorithm>
#include <utility>

#include "fbvins/estimator/sliding_window.hpp"

namespace fbvins {
namespace {

/// W may have drifted since a landmark was seen, but not by more than this many times what tells it from others.
constexpr double kFarFromPrior = 5;
/// A landmark further from its prior than this is another one.
constexpr double kPriorOutlier_sigma = 6;
/// Observations further off than this in a solution are removed.
constexpr double kOutlier_sigma = 4;

/// Takes away the observations of a landmark that are further off than that; how many.
int remove_far_observations(Landmark& landmark, const WindowProblem& solved, const WindowLandmark& numbers) {
  int removed = 0;
  std::vector<FrameId> gone;
  for (int k = 0; k < numbers.observation_count; ++k) {
    const WindowObservation& o = solved.observations[numbers.first_observation + k];
    if (!(solved.residual(numbers, o).norm() > kOutlier_sigma)) continue;
    ++removed;
    const FrameId frame = solved.frames[o.frame].id;
    if (!o.right) gone.push_back(frame);
    else if (const Sighting* s = landmark.sighting_in(frame)) landmark.sightings[s - landmark.sightings.data()].right.reset();
  }
  std::erase_if(landmark.sightings,
                [&](const Sighting& s) { return std::find(gone.begin(), gone.end(), s.frame) != gone.end(); });
  return removed;
}

}  // namespace

int SlidingWindow::remove_outliers(const WindowProblem& solved) {
  int removed = 0;
  for (const WindowLandmark& numbers : solved.landmarks) {
    Landmark* landmark = landmarks_.find(numbers.id);
    const int of_this = landmark ? remove_far_observations(*landmark, solved, numbers) : 0;
    if (of_this > 0) strike(*landmark, solved, numbers);
    removed += of_this;
  }
  landmarks_.remove_unseen();
  return removed;
}

/// Some of its observations were thrown out.
void SlidingWindow::strike(Landmark& landmark, const WindowProblem& solved, const WindowLandmark& numbers) {
  landmark.strikes += 1;
  const bool too_near = numbers.alpha_beta_rho.z() > 1.0 / kNearestLandmark_m;
  if (landmark.sightings.size() < 2 || landmark.strikes >= LandmarkTable::kStrikesUntilBanned || too_near) {
    landmarks_.keep_strikes(landmark);
    landmark.sightings.clear();
  } else if (landmark.sightings.front().frame != landmark.host && !landmark.seen_in(landmark.host)) {
    rehost(landmark, landmark.sightings.front().frame, frames_, solved.calibration);
  }
}

int SlidingWindow::refuse_landmark_priors(const WindowProblem& solved) {
  int refused = 0;
  for (const WindowLandmark& l : solved.landmarks) {
    if (l.prior < 0 || solved.distance_to_prior(l).norm() <= kPriorOutlier_sigma) continue;
    if (Landmark* landmark = landmarks_.find(l.id)) drop_prior(*landmark);
    ++refused;
  }
  return refused;
}

/// One that is nowhere near is another one, and would spoil the whole solve.
void SlidingWindow::refuse_distant_prior(Landmark& landmark, const Calibration& calibration) {
  const WindowLandmark numbers{.alpha_beta_rho = landmark.alpha_beta_rho};
  const Pose<W, B>& host = frames_.at(landmark.host).state.T_WB;
  const double distance_sigma = landmark_prior_residual(CameraGeometry(calibration), host, numbers, *landmark.prior).norm();
  if (distance_sigma < kFarFromPrior * kPriorOutlier_sigma) return;
  drop_prior(landmark);
}

void SlidingWindow::drop_prior(Landmark& landmark) {
  landmark.prior.reset();
  known_.forget(landmark.track);
}

/// Of those still in view the position now found holds what comes: they are re-observed at once.
void SlidingWindow::remember(const WindowProblem& problem, std::span<const LeavingLandmark> leaving,
                             std::span<const Mat3> information) {
  if (!remembers_landmarks()) return;
  for (std::size_t k = 0; k < leaving.size(); ++k) {
    const WindowLandmark& numbers = problem.landmarks[leaving[k].index];
    Landmark& landmark = *landmarks_.find(numbers.id);
    const Pose<W, C0> T_WC = problem.frames[numbers.host].state.T_WB * problem.calibration.T_BC0;
    known_.remember(landmark.track, T_WC, numbers.alpha_beta_rho, information[k]);
    landmark.prior = known_.find(landmark.track);
  }
}

}  // namespace fbvins
