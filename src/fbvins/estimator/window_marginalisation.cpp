// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_marginalisation.hpp"

namespace fbvins {
namespace {

/// The factors that go into the new prior, as a problem of their own.
void select_factors(const WindowProblem& problem, int leaving, const std::vector<std::uint8_t>& landmark_leaves,
                    WindowProblem& out) {
  out.frames = problem.frames;
  out.tilt = problem.tilt;
  out.calibration = problem.calibration;
  out.weights = problem.weights;
  out.weights.at_first_estimates = true;
  out.prior = problem.prior;
  out.landmarks.clear();
  out.observations.clear();
  out.beliefs = problem.beliefs;
  for (int i = 0; i < static_cast<int>(out.frames.size()); ++i) {
    if (i != leaving && i != leaving + 1) out.frames[i].imu = nullptr;
    if (i != leaving) out.frames[i].standstill = false;
  }
  for (std::size_t i = 0; i < problem.landmarks.size(); ++i) {
    if (!landmark_leaves[i]) continue;
    WindowLandmark landmark = problem.landmarks[i];
    const auto first = problem.observations.begin() + landmark.first_observation;
    landmark.first_observation = static_cast<int>(out.observations.size());
    out.observations.insert(out.observations.end(), first, first + landmark.observation_count);
    out.landmarks.push_back(landmark);
  }
}

/// Frames that any factor of the problem touches.
std::vector<std::uint8_t> touched_frames(const WindowProblem& problem) {
  std::vector<std::uint8_t> touched(problem.frames.size(), 0);
  for (int frame : problem.prior.frames) touched[frame] = 1;
  for (std::size_t i = 1; i < problem.frames.size(); ++i)
    if (problem.frames[i].imu != nullptr) touched[i - 1] = touched[i] = 1;
  for (const WindowLandmark& l : problem.landmarks) {
    touched[l.host] = 1;
    for (int k = 0; k < l.observation_count; ++k) touched[problem.observations[l.first_observation + k].frame] = 1;
  }
  return touched;
}

}  // namespace

WindowPrior marginalise_frame(const WindowProblem& problem, int leaving, const std::vector<std::uint8_t>& landmark_leaves,
                              WindowProblem& scratch) {
  select_factors(problem, leaving, landmark_leaves, scratch);
  scratch.linearise();
  const Eigen::MatrixXd information = scratch.reduced_information();

  WindowPrior out;
  out.with_tilt = problem.weights.estimate_tilt;
  out.with_calibration = problem.calibrating();
  out.calibration = problem.prior.with_calibration ? problem.prior.calibration : problem.calibration;
  std::vector<int> keep, drop;
  for (int k = 0; k < scratch.tilt_size(); ++k) keep.push_back(scratch.tilt_row() + k);
  if (out.with_calibration)
    for (int k = 0; k < kCalibrationSize; ++k) keep.push_back(scratch.calibration_row() + k);
  const std::vector<std::uint8_t> touched = touched_frames(scratch);
  for (int i = 0; i < static_cast<int>(problem.frames.size()); ++i) {
    if (i != leaving && !touched[i]) continue;
    if (i != leaving) out.frames.push_back(i);
    for (int k = 0; k < 15; ++k) (i == leaving ? drop : keep).push_back(scratch.row_of(i, k));
  }
  out.quadratic = marginalise(information, scratch.reduced_gradient(), keep, drop);

  // The gradient was taken at the current estimate; the prior is measured from the first estimates.
  Eigen::VectorXd back = Eigen::VectorXd::Zero(out.quadratic.size());
  if (out.with_tilt) back.head<kTiltSize>() = -problem.tilt.angle_rad;
  if (problem.prior.with_calibration)
    back.segment<kCalibrationSize>(out.calibration_row()) = -scratch.calibration_displacement(out.calibration);
  int at = out.frames_row();
  for (int frame : out.frames) {
    if (problem.frames[frame].in_prior)
      back.segment<15>(at) = -problem.frames[frame].state.boxminus(problem.frames[frame].first_estimate);
    at += 15;
  }
  out.quadratic = shifted(std::move(out.quadratic), back);
  return out;
}

}  // namespace fbvins
