// SPDX-License-Identifier: Apache-2.0
// The sliding window's landmarks: outliers among observations and priors, and landmarks that are remembered.

#include "fbvins/estimator/sliding_window.hpp"

namespace fbvins {
namespace {

/// Before a solve a landmark may be this many times kPriorOutlier_sigma from its prior, since the window may have drifted.
constexpr double kFarFromPrior = 5;
/// After a solve a landmark farther from its prior than this is taken for another one.
constexpr double kPriorOutlier_sigma = 6;
/// Observations with a larger residual in a solution are removed.
constexpr double kOutlier_sigma = 4;

/// Removes the outliers among the observations of a landmark, which have these residuals. Returns how many.
int remove_far_observations(Landmark& landmark, const WindowProblem& solved, const WindowLandmark& numbers,
                            const std::vector<Vec2>& residuals) {
  int removed = 0;
  for (int k = 0; k < numbers.observation_count; ++k) {
    const WindowObservation& o = solved.observations[numbers.first_observation + k];
    if (!(residuals[static_cast<std::size_t>(k)].norm() > kOutlier_sigma)) continue;
    ++removed;
    // The positions in other cameras were found from the lead's: they go with it.
    std::erase_if(landmark.observations, [&](const Sighting& s) {
      return s.frame == solved.frames[o.frame].id && (s.seen.camera == o.camera || o.camera == landmark.lead);
    });
  }
  return removed;
}

}  // namespace

int SlidingWindow::remove_outliers(const WindowProblem& solved) {
  const CameraGeometry cameras(solved.calibration);
  std::vector<Vec2> residuals;
  int removed = 0;
  for (const WindowLandmark& numbers : solved.landmarks) {
    Landmark* landmark = landmarks_.find(numbers.id);
    if (landmark) solved.residuals(cameras, numbers, residuals);
    const int of_this = landmark ? remove_far_observations(*landmark, solved, numbers, residuals) : 0;
    if (of_this > 0) count_outlier(*landmark, solved, numbers);
    removed += of_this;
  }
  landmarks_.remove_unseen();
  return removed;
}

/// Counts a solve in which a landmark had outliers; removes it where too little is left of it.
void SlidingWindow::count_outlier(Landmark& landmark, const WindowProblem& solved, const WindowLandmark& numbers) {
  landmark.outlier_count += 1;
  const bool too_near = numbers.alpha_beta_rho.z() > 1.0 / kNearestLandmark_m;
  if (!landmark.by_several_frames() || landmark.outlier_count >= LandmarkTable::kOutliersUntilRejected || too_near) {
    landmarks_.keep_outlier_count(landmark);
    landmark.observations.clear();
  } else if (landmark.observations.front().frame != landmark.host && !landmark.seen_in(landmark.host)) {
    rehost(landmark, landmark.observations.front().frame, frames_, solved.calibration);
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

/// A landmark very far from its prior is another one; its factor would spoil the solve.
void SlidingWindow::refuse_distant_prior(Landmark& landmark, const Calibration& calibration) {
  const WindowLandmark numbers{.camera = landmark.ray_camera, .alpha_beta_rho = landmark.alpha_beta_rho};
  const Pose<G, B>& host = frames_.at(landmark.host).state.T_FB;
  const double distance_sigma = landmark_prior_residual(CameraGeometry(calibration), host, numbers, *landmark.prior).norm();
  if (distance_sigma < kFarFromPrior * kPriorOutlier_sigma) return;
  drop_prior(landmark);
}

void SlidingWindow::forget_known() {
  known_.clear();
  for (Landmark& landmark : landmarks_.all()) landmark.prior.reset();
}

void SlidingWindow::drop_prior(Landmark& landmark) {
  landmark.prior.reset();
  known_.forget(landmark.track);
}

/// Those still in view are constrained by the remembered position at once.
void SlidingWindow::remember(const WindowProblem& problem, std::span<const LeavingLandmark> leaving,
                             std::span<const Mat3> information) {
  if (!options_.known_landmarks.enabled) return;
  for (std::size_t k = 0; k < leaving.size(); ++k) {
    const WindowLandmark& numbers = problem.landmarks[leaving[k].index];
    Landmark& landmark = *landmarks_.find(numbers.id);
    const Pose<G, C0> T_GC = problem.frames[numbers.host].state.T_FB * problem.calibration.T_BC(numbers.camera);
    known_.remember(landmark.track, T_GC, numbers.alpha_beta_rho, information[k]);
    landmark.prior = known_.find(landmark.track);
  }
}

}  // namespace fbvins
