// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_marginalisation.hpp"

#include <cstdint>
#include <utility>

namespace fbvins {
namespace {

/// The factors that go into the new prior, as a problem of their own.
void select_factors(const WindowProblem& problem, int leaving, std::span<const LeavingLandmark> landmarks, WindowProblem& out) {
  out.frames = problem.frames;
  out.tilt = problem.tilt;
  out.calibration = problem.calibration;
  out.weights = problem.weights;
  // With one camera the scale may still change by a tenth: first estimates of different scales would be taken for a motion
  // that shows it.
  out.weights.at_first_estimates = problem.weights.images_show_scale;
  out.prior = problem.prior;
  out.landmarks.clear();
  out.observations.clear();
  out.landmark_priors = problem.landmark_priors;
  out.factors.clear();
  for (const std::shared_ptr<const Factor>& factor : problem.factors)
    if (factor->touches(problem.frames[leaving].id)) out.factors.push_back(factor);
  for (const LeavingLandmark& l : landmarks) {
    WindowLandmark landmark = problem.landmarks[l.index];
    const auto first = problem.observations.begin() + landmark.first_observation;
    landmark.first_observation = static_cast<int>(out.observations.size());
    landmark.observation_count = l.observations;
    out.observations.insert(out.observations.end(), first, first + l.observations);
    out.landmarks.push_back(landmark);
  }
}

/// Frames that any factor of the problem touches.
std::vector<std::uint8_t> touched_frames(const WindowProblem& problem) {
  std::vector<std::uint8_t> touched(problem.frames.size(), 0);
  for (int frame : problem.prior.frames) touched[frame] = 1;
  for (const std::shared_ptr<const Factor>& factor : problem.factors)
    for (const Variable& v : factor->variables())
      if (v.is_of_frame()) touched[problem.index_of(v.frame)] = 1;
  for (const WindowLandmark& l : problem.landmarks) {
    touched[l.host] = 1;
    for (int k = 0; k < l.observation_count; ++k) touched[problem.observations[l.first_observation + k].frame] = 1;
  }
  return touched;
}

/// From the present estimate, at which the new prior's gradient was taken, to the prior's origin (-e of W12).
Eigen::VectorXd displacement_to_origin(const WindowProblem& problem, const WindowPrior& prior) {
  Eigen::VectorXd back = Eigen::VectorXd::Zero(prior.quadratic.size());
  if (prior.with_tilt) back.head<kTiltSize>() = -problem.tilt.angle_rad;
  if (problem.prior.with_calibration)
    back.segment<kCalibrationSize>(prior.calibration_row()) = -calibration_displacement(problem.calibration, prior.calibration);
  int at = prior.frames_row();
  for (int frame : prior.frames) {
    if (problem.frames[frame].in_prior)
      back.segment<15>(at) = -problem.frames[frame].state.boxminus(problem.frames[frame].first_estimate);
    at += 15;
  }
  return back;
}

}  // namespace

std::vector<LeavingLandmark> landmarks_leaving_with(const WindowProblem& problem, int leaving, int newest_begin) {
  std::vector<LeavingLandmark> out;
  for (int i = 0; i < static_cast<int>(problem.landmarks.size()); ++i) {
    const WindowLandmark& l = problem.landmarks[i];
    if (l.host != leaving) continue;
    const WindowObservation* seen = problem.observations.data() + l.first_observation;
    const bool in_view = seen[l.observation_count - 1].frame == problem.frame_count() - 1;
    int count = l.observation_count;
    if (in_view) {
      int frames = 0;
      for (count = 0; count < l.observation_count && seen[count].frame < newest_begin; ++count)
        frames += count == 0 || seen[count].frame != seen[count - 1].frame;
      if (frames < 2) continue;  // no information on motion
    }
    out.push_back({i, count, in_view});
  }
  return out;
}

Marginalised marginalise_frame(const WindowProblem& problem, int leaving, std::span<const LeavingLandmark> landmarks,
                               MarginalisationMemory& memory) {
  WindowProblem& factors = memory.factors;
  NormalEquations& equations = memory.equations;
  select_factors(problem, leaving, landmarks, factors);
  linearise(factors, memory.pairs, equations);
  const ReducedEquations information = reduced(equations);
  const WindowLayout& at = equations.layout;

  Marginalised out;
  for (const PointBlock& point : equations.points.points()) out.landmark_information.push_back(point.V);
  WindowPrior& prior = out.prior;
  prior.with_tilt = problem.weights.estimate_tilt;
  prior.with_calibration = problem.calibrating();
  prior.calibration = problem.prior.with_calibration ? problem.prior.calibration : problem.calibration;
  std::vector<int> keep, drop;
  for (int k = 0; k < at.tilt_size; ++k) keep.push_back(at.tilt_row() + k);
  if (prior.with_calibration)
    for (int k = 0; k < kCalibrationSize; ++k) keep.push_back(at.calibration_row() + k);
  const std::vector<std::uint8_t> touched = touched_frames(factors);
  for (int i = 0; i < problem.frame_count(); ++i) {
    if (i != leaving && !touched[i]) continue;
    if (i != leaving) prior.frames.push_back(i);
    for (int k = 0; k < 15; ++k) (i == leaving ? drop : keep).push_back(at.row_of(i, k));
  }
  prior.quadratic = marginalise(information.H, information.g, keep, drop);
  // The gradient was taken at the present estimate; the prior's origin is the first estimates (W12).
  // Computed before the prior is moved from: the order in which arguments are evaluated is unspecified.
  const Eigen::VectorXd back = displacement_to_origin(problem, prior);
  prior.quadratic = shifted(std::move(prior.quadratic), back);
  return out;
}

}  // namespace fbvins
