// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/keyframe_policy.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <optional>
#include <utility>

#include "fbvins/estimator/window_views.hpp"

namespace fbvins {
namespace {

/// The newest keyframes share too few later frames yet for their information to be judged.
constexpr int kTooNewToJudge = 2;
/// A new keyframe when fewer of the features than this were seen by the last one.
constexpr double kMinSharedRatio = 0.7;
/// A new keyframe when the images have moved by so much since, rotation left out, in the median.
constexpr double kMinParallax_px = 12;
/// A new keyframe after this time at the latest; at rest, where the view stays the same, only so that the readings since the
/// last one stay few.
constexpr double kMaxInterval_s = 1.0, kMaxIntervalAtRest_s = 10.0;

}  // namespace

bool KeyframePolicy::is_keyframe(const SlidingWindow& window, const Calibration& calibration, bool standstill) const {
  const KeyframeDistance d = distance_to_last_keyframe(window, calibration, focal_px_);
  if (standstill) return d.age.seconds() > kMaxIntervalAtRest_s;
  return d.shared_ratio < kMinSharedRatio || d.parallax_px > kMinParallax_px || d.age.seconds() > kMaxInterval_s;
}

int KeyframePolicy::leaving(const SlidingWindow& window, const Calibration& calibration, int keyframes) {
  if (options_.leaving == KeyframeLeaving::oldest) return 0;
  WindowProblem problem;
  window.fill_problem(calibration, problem);
  return least_informative_keyframe(problem, keyframes, solver_);
}

std::vector<Keyframe> KeyframePolicy::take_final(SlidingWindow& window, const WindowSolution& solution,
                                                 const Calibration& calibration) {
  std::vector<Keyframe> out;
  for (int i = 0; i < zone(window); ++i) {
    const Frame& frame = window.frames()[i];
    if (!frame.keyframe || frame.id <= newest_final_) continue;
    newest_final_ = frame.id;
    Keyframe keyframe = keyframe_of(window, i, calibration);
    keyframe.images = window.take_images(i);
    keyframe.gauge = gauge_state_of(window, frame.state);
    if (const std::optional<Mat17> covariance = solution.covariance(frame.id)) {
      keyframe.gauge.up_sigma_rad = up_sigma_rad(*covariance);
      keyframe.pose_covariance = window.known().with_map_covariance(frame.state.T_FB, covariance->topLeftCorner<6, 6>());
    }
    out.push_back(std::move(keyframe));
  }
  return out;
}

void KeyframePolicy::shrink(SlidingWindow& window, const WindowSolution& solution, const Calibration& calibration) {
  for (int i = zone(window) - 1; i >= 1; --i)
    if (!window.frames()[i].keyframe) window.drop_frame(i, calibration);
  while (zone(window) > options_.max_keyframes) {
    const int leaves = leaving(window, calibration, zone(window));
    const Frame& host = window.frames()[leaves];
    if (const std::optional<Mat17> covariance = solution.covariance(host.id))
      window.known().set_host_uncertainty(host.state.T_FB, covariance->topLeftCorner<6, 6>());
    window.marginalise_keyframe(leaves, calibration);
  }
}

double entropy_of_newest(const WindowProblem& problem, int unseen, WindowSolver& solver) {
  WindowProblem without = problem;
  without.observations.clear();
  for (WindowLandmark& l : without.landmarks) {
    const int first = static_cast<int>(without.observations.size());
    for (int k = 0; k < l.observation_count; ++k) {
      const WindowObservation& o = problem.observations[l.first_observation + k];
      if (o.frame != unseen) without.observations.push_back(o);
    }
    l.first_observation = first;
    l.observation_count = static_cast<int>(without.observations.size()) - first;
  }
  // A landmark with fewer than two rays left has no information; it would only make the elimination singular.
  std::erase_if(without.landmarks, [](const WindowLandmark& l) { return l.observation_count < 2; });
  solver.linearise(without);
  WindowInformation information;
  if (!solver.step(0, information)) return 0;
  const std::optional<Mat17> covariance = information.covariance(without.frame_count() - 1);
  if (!covariance) return 0;
  const Eigen::LLT<Mat15> llt(covariance->topLeftCorner<15, 15>());
  return llt.matrixLLT().diagonal().array().log().sum();  // ln det(covariance) / 2
}

int least_informative_keyframe(const WindowProblem& problem, int keyframes, WindowSolver& solver) {
  // The entropy with all observations is the same for all: the smallest gain (E3) has the smallest entropy without them.
  int least = 0;
  double least_entropy = 0;
  for (int i = 0; i < std::max(1, keyframes - kTooNewToJudge); ++i) {
    const double entropy = entropy_of_newest(problem, i, solver);
    if (i > 0 && entropy >= least_entropy) continue;
    least = i;
    least_entropy = entropy;
  }
  return least;
}

}  // namespace fbvins
