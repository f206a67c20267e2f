// SPDX-License-Identifier: Apache-2.0
// Levenberg-Marquardt over any problem that can linearise, solve, try a step and take it back.
// Work is limited in iterations, never in seconds.
//
//   struct Problem {
//     double linearise();                 // builds the normal equations at the estimate; returns its cost
//     bool solve(double lambda);          // damped step; false if not positive definite
//     double predicted_decrease() const;  // of the quadratic model for the last step
//     double step_size() const;           // some norm of the last step, compared with min_step
//     double apply_step();                // moves the estimate; returns the new cost
//     void undo_step();
//   };
#pragma once

#include <algorithm>
#include <cmath>

namespace fbvins {

struct LmOptions {
  int max_iterations = 5;
  double initial_lambda = 1e-6;
  double max_lambda = 1e6;
  double min_step = 1e-6;               ///< converged when the step is smaller
  double min_relative_decrease = 1e-4;  ///< converged when the cost falls by less than this share
};

struct LmSummary {
  int iterations = 0;  ///< linearisations
  int rejected = 0;    ///< steps taken back
  double initial_cost = 0;
  double final_cost = 0;
  bool usable = true;  ///< false if no step could be computed or the cost is not finite
};

template <class Problem>
LmSummary minimise(Problem& problem, const LmOptions& options) {
  LmSummary summary;
  double lambda = options.initial_lambda;
  double cost = 0;
  for (int i = 0; i < options.max_iterations; ++i) {
    cost = problem.linearise();
    ++summary.iterations;
    if (i == 0) summary.initial_cost = summary.final_cost = cost;
    if (!std::isfinite(cost)) {
      summary.usable = false;
      return summary;
    }
    bool accepted = false;
    double decrease = 0, step = 0;
    while (!accepted && lambda <= options.max_lambda) {
      if (problem.solve(lambda)) {
        step = problem.step_size();
        const double trial = problem.apply_step();
        decrease = cost - trial;
        // A model that promises nothing measurable has converged: keep the step if it does no harm.
        const double promised = problem.predicted_decrease();
        if (std::isfinite(trial) && (decrease > 1e-3 * promised || std::abs(decrease) <= 1e-12 * cost)) {
          accepted = true;
          summary.final_cost = trial;
          lambda = std::max(lambda / 5, 1e-10);
          break;
        }
        problem.undo_step();
        ++summary.rejected;
        if (step < options.min_step) break;
      }
      lambda = std::max(lambda, 1e-8) * 10;
    }
    if (!accepted) {
      summary.usable = i > 0 || step < options.min_step;
      return summary;
    }
    if (step < options.min_step || decrease < options.min_relative_decrease * cost) return summary;
  }
  return summary;
}

}  // namespace fbvins
