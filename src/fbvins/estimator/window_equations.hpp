// SPDX-License-Identifier: Apache-2.0
// Cost and normal equations of a window, landmarks not yet eliminated (docs/derivations/window.md, W2-W9). Pure functions; the
// values they fill reuse their memory from call to call.
//
//   double cost = linearise(window, pairs, equations);
#pragma once

#include <vector>

#include "fbvins/estimator/window_problem.hpp"
#include "fbvins/optim/schur.hpp"

namespace fbvins {

/// Where each variable is in the dense system: 9 of each frame (v, bg, ba), 2 of the tilt if it is estimated, the factors' own,
/// calibration if it is estimated, 6 of each frame (p, theta). Consecutive poses are adjacent, which makes long runs for the
/// Schur kernel.
struct WindowLayout {
  int frames = 0;
  int tilt_size = 0;
  int own_size = 0;
  int calibration_size = 0;

  WindowLayout() = default;
  explicit WindowLayout(const WindowProblem& window)
      : frames(window.frame_count()),
        tilt_size(window.weights.estimate_tilt ? kTiltSize : 0),
        own_size(0),
        calibration_size(window.calibrating() ? kCalibrationSize : 0) {
    for (const OwnVariable& v : window.own) own_size += static_cast<int>(v.value.size());
  }

  int size() const { return 15 * frames + tilt_size + own_size + calibration_size; }
  int speed_bias_row(int frame) const { return 9 * frame; }
  int tilt_row() const { return 9 * frames; }
  int own_row() const { return tilt_row() + tilt_size; }
  int calibration_row() const { return own_row() + own_size; }
  int pose_row(int frame) const { return calibration_row() + calibration_size + 6 * frame; }
  /// Of element k of a frame's 15 numbers (p, theta, v, bg, ba).
  int row_of(int frame, int k) const { return k < 6 ? pose_row(frame) + k : speed_bias_row(frame) + k - 6; }
};

struct NormalEquations;

/// Where the variable begins.
int row_of(const WindowProblem& window, const WindowLayout& at, const Variable& variable);
/// Adds a factor's whitened residual r, of weight `weight`, with its derivatives by `variables`, whose columns follow one another
/// in J; those that are not estimated have none.
void add_residual(const WindowProblem& window, const std::vector<Variable>& variables, const Eigen::MatrixXd& J,
                  const Eigen::VectorXd& r, double weight, NormalEquations& out);
/// Of all variables of the prior, in its order.
std::vector<int> rows_of(const WindowProblem& window, const WindowLayout& at, const WindowPrior& prior);

/// Relative geometry of every pair of frames.
class PairTable {
 public:
  void fill(const WindowProblem& window, bool with_first_estimates);
  const PairGeometry& operator()(int host, int target) const { return pairs_[host * n_ + target]; }

 private:
  std::size_t n_ = 0;
  std::vector<PairGeometry> pairs_;
};

struct NormalEquations {
  WindowLayout layout;
  bool gradient_alone = false;  ///< nobody reads H: what is added to it may be left out
  Eigen::MatrixXd H;            ///< lower triangle
  Eigen::VectorXd g;
  PointBlocks points;  ///< landmarks, in the window's order
};

/// Frames, tilt and calibration with the landmarks eliminated; at least the lower triangle.
struct ReducedEquations {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};

/// Of the cost by all variables.
struct WindowGradient {
  Eigen::VectorXd dense;        ///< by what NormalEquations::g is of
  std::vector<Vec3> landmarks;  ///< in the window's order
  NormalEquations of_factors;   ///< working memory
};

/// Cost at the window's estimate.
double cost_of(const WindowProblem& window, PairTable& pairs);
/// The same, with the gradient. Not while calibrating.
double gradient_of(const WindowProblem& window, PairTable& pairs, WindowGradient& out);
/// The same, with the normal equations.
double linearise(const WindowProblem& window, PairTable& pairs, NormalEquations& out);
/// Eliminates the landmarks without damping (W10); H is filled in both triangles.
ReducedEquations reduced(NormalEquations& equations);

/// Terms of all landmarks: reprojections and landmark priors. In window_landmark_terms.cpp.
double landmark_cost(const WindowProblem& window, const PairTable& pairs);
double add_landmark_gradient(const WindowProblem& window, const PairTable& pairs, const WindowLayout& at, WindowGradient& out);
double add_landmarks(const WindowProblem& window, const PairTable& pairs, NormalEquations& out);

}  // namespace fbvins
