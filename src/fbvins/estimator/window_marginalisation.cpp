// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_marginalisation.hpp"

#include <algorithm>
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
  out.own = problem.own;
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

/// Numbers of the own variables that the prior and the factors of the problem name.
std::vector<int> named_own(const WindowProblem& problem) {
  std::vector<int> out = problem.prior.own;
  for (const std::shared_ptr<const Factor>& factor : problem.factors)
    for (const Variable& v : factor->variables())
      if (v.kind == Variable::Kind::own) out.push_back(v.own);
  return out;
}

/// Own variables of the new prior, and of those that leave with the frame the rows: nothing else names them, or wants them later.
std::vector<int> divide_own(const WindowProblem& problem, const WindowProblem& factors, FrameId leaving, const WindowLayout& at,
                            WindowPrior& prior) {
  WindowProblem rest;
  for (const std::shared_ptr<const Factor>& factor : problem.factors)
    if (!factor->touches(leaving)) rest.factors.push_back(factor);
  const auto contains = [](const std::vector<int>& all, int n) { return std::find(all.begin(), all.end(), n) != all.end(); };
  const std::vector<int> named = named_own(factors), needed = named_own(rest);
  std::vector<int> leaving_rows;
  for (const OwnVariable& v : problem.own) {
    if (!contains(named, v.number)) continue;
    const int size = static_cast<int>(v.value.size());
    if (v.is_wanted || contains(needed, v.number)) {
      prior.own.push_back(v.number);
      prior.own_size += size;
    } else {
      const int row = row_of(factors, at, Variable::own_one(v.number));
      for (int k = 0; k < size; ++k) leaving_rows.push_back(row + k);
    }
  }
  return leaving_rows;
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
  std::vector<int> drop = divide_own(problem, factors, problem.frames[leaving].id, at, prior);
  const std::vector<std::uint8_t> touched = touched_frames(factors);
  for (int i = 0; i < problem.frame_count(); ++i)
    if (i != leaving && touched[i]) prior.frames.push_back(i);
  const std::vector<int> keep = rows_of(factors, at, prior);
  for (int k = 0; k < 15; ++k) drop.push_back(at.row_of(leaving, k));
  prior.quadratic = marginalise(information.H, information.g, keep, drop);
  // The gradient was taken at the present estimate; the prior's origin is the first estimates (W12).
  // Computed before the prior is moved from: the order in which arguments are evaluated is unspecified.
  const Eigen::VectorXd back = -problem.displacement(prior);
  prior.quadratic = shifted(std::move(prior.quadratic), back);
  return out;
}

}  // namespace fbvins
