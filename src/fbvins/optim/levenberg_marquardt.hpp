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
//
//     bool step_again();                  // where there are these two, steps are made with the information of the last
//     void move();                        // linearisation and the gradient at the estimate (follow())
//   };
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>

namespace fbvins {

struct LmOptions {
  int max_iterations = 5;
  /// Relative to the information's diagonal. IMU factors put up to 1e11 there, so that 1e-9 would be information of its own
  /// about the position, which without images is known to a metre (1).
  double initial_lambda = 1e-13;
  double retry_lambda = 1e-8;  ///< after a first step that failed
  int max_retries = 6;         ///< steps tried at one linearisation, lambda growing tenfold
  double min_step = 1e-6;      ///< converged when the step is smaller
  /// Converged when the cost, half a chi-square, falls by less than this. Absolute, because a prior's
  /// cost has no meaningful zero; 0.05 is a third of a sigma along one direction. Also converged when the decrease
  /// differs from the predicted one by less than this: the quadratic model is accurate there, and so is its minimum.
  double min_decrease = 0.05;
  int max_followed = 3;  ///< steps with the information of one linearisation, beside its own, of a problem that KeepsInformation
  /// Where such steps no longer help, another linearisation is worth its time if the last one was longer than this.
  double worth_linearising = 0;
};

struct LmSummary {
  int iterations = 0;  ///< linearisations
  int followed = 0;    ///< steps with the information of an earlier one
  int rejected = 0;    ///< steps taken back
  double initial_cost = 0;
  double final_cost = 0;
  bool usable = true;  ///< false if no step could be computed or the cost is not finite
};

/// A linearisation serves for several steps: apply_step() finds the gradient beside the cost, and step_again() makes a step of it
/// and of the information as it was, or says that it cannot. Far cheaper than a linearisation, and as good near the minimum.
template <class Problem>
concept KeepsInformation = requires(Problem problem) {
  { problem.step_again() } -> std::same_as<bool>;
  problem.move();  // the step that was solved last, without evaluating
};

/// Steps with the information of the last linearisation. True where they converged; false where another is needed.
template <KeepsInformation Problem>
bool follow(Problem& problem, const LmOptions& options, LmSummary& summary) {
  for (int i = 0; i < options.max_followed; ++i) {
    if (!problem.step_again()) return false;
    const double predicted = problem.predicted_decrease();
    if (predicted < options.min_decrease || problem.step_size() < options.min_step) {
      problem.move();
      summary.final_cost -= predicted;
      return true;
    }
    ++summary.followed;
    const double decrease = summary.final_cost - problem.apply_step();
    if (!(decrease > 0.5 * predicted)) {
      problem.undo_step();
      ++summary.rejected;
      break;
    }
    summary.final_cost -= decrease;
    if (std::abs(predicted - decrease) < options.min_decrease) return true;
  }
  return problem.step_size() < options.worth_linearising;
}

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
    bool accepted = false, converged = false;
    double decrease = 0, predicted = 0;
    for (int retry = 0; !accepted && !converged && retry < options.max_retries; ++retry) {
      if (problem.solve(lambda)) {
        const double trial = problem.apply_step();
        predicted = problem.predicted_decrease();
        decrease = cost - trial;
        converged = problem.step_size() < options.min_step || predicted < options.min_decrease;
        accepted = std::isfinite(trial) && decrease > 1e-3 * predicted;
        if (accepted) {
          summary.final_cost = trial;
          lambda = std::max(lambda / 5, options.initial_lambda);
          break;
        }
        problem.undo_step();
        ++summary.rejected;
      }
      lambda = std::max(10 * lambda, options.retry_lambda);
    }
    if (!accepted) {
      summary.usable = i > 0 || converged;
      return summary;
    }
    if (converged || decrease < options.min_decrease || std::abs(predicted - decrease) < options.min_decrease) return summary;
    if constexpr (KeepsInformation<Problem>)
      if (follow(problem, options, summary)) return summary;
  }
  return summary;
}

}  // namespace fbvins
