// SPDX-License-Identifier: Apache-2.0
// Minimises a WindowProblem by optim/levenberg_marquardt.hpp, and gives the covariance of the solution.
//
//   WindowSolver solver;                       // keeps its working memory from call to call; one thread
//   WindowSolution solution;
//   solution.window = ...;
//   solver.solve(solution, LmOptions{});
//   if (solution.summary.usable) use(solution.window.frames, solution.information.covariance(0));
#pragma once

#include <optional>
#include <vector>

#include "fbvins/estimator/window_equations.hpp"
#include "fbvins/optim/envelope_cholesky.hpp"
#include "fbvins/optim/levenberg_marquardt.hpp"

namespace fbvins {

/// Cholesky factor of the information matrix of frames, tilt and calibration, the landmarks eliminated. A value.
class WindowInformation {
 public:
  /// From the lower triangle; false where it is not positive definite.
  bool factorise(const WindowLayout& layout, const Eigen::MatrixXd& information);
  Eigen::VectorXd solve(const Eigen::VectorXd& rhs) const { return factor_.solve(rhs); }
  /// Of a frame's (p, theta, v, bg, ba) and the tilt (zero where it is not estimated); none without a factor.
  std::optional<Mat17> covariance(int frame) const;
  void clear() { valid_ = false; }

 private:
  WindowLayout layout_;
  EnvelopeCholesky factor_;
  bool valid_ = false;
};

/// A window at its minimum.
struct WindowSolution {
  WindowProblem window;  ///< filled by the caller, and minimised in place
  LmSummary summary;
  WindowInformation information;  ///< at the last linearisation, with negligible damping at most

  /// Of a frame of the window, as WindowInformation::covariance().
  std::optional<Mat17> covariance(FrameId frame) const;
};

/// A step of all variables, and the cost decrease that the damped quadratic model predicts for it.
struct WindowStep {
  Eigen::VectorXd dense;
  std::vector<Vec3> landmarks;
  double predicted_decrease = 0;
  double size = 0;  ///< largest element of the poses' part
};

class WindowSolver {
 public:
  void solve(WindowSolution& solution, const LmOptions& options);

  /// The parts of solve(): linearises at the window's estimate; then a damped step from there, and its factor.
  double linearise(const WindowProblem& window);
  bool step(double lambda, WindowInformation& information);
  /// Cost and gradient at the window's estimate; then a step with that gradient and the information of the last step().
  double renew_gradient(const WindowProblem& window);
  bool step_again(double lambda, const WindowInformation& information);
  const WindowStep& step() const { return step_; }
  const NormalEquations& equations() const { return equations_; }

 private:
  struct Descent;
  ThirdDamping depth_damping(double lambda) const;
  bool finish_step(double lambda, const WindowInformation& information);

  PairTable pairs_;
  NormalEquations equations_;
  ReducedEquations reduced_;
  WindowGradient gradient_;
  WindowStep step_;
  bool images_show_scale_ = true;  ///< of the window that was linearised
};

}  // namespace fbvins
