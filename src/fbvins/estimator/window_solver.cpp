// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_solver.hpp"

#include <algorithm>

namespace fbvins {
namespace {

/// Keeps directions without any measurement solvable; far below any real information.
constexpr double kRegularisation = 1e-8;
constexpr double kNegligibleLambda = 1e-12;
/// Damps steps of the inverse depth, 1 m^2. One camera at rest hardly observes it: an undamped step would put the landmark
/// right before the lens, and the step of all variables would be refused. Changes no minimum and enters no prior.
constexpr double kDepthDamping = 1.0;

/// Of a step that shrinks everything, the largest share that is made as one.
constexpr double kMostShrinking = 0.5;

/// By which share a step makes all depths longer (W10b).
double common_scale(const WindowProblem& window, const std::vector<PointBlock>& points, const std::vector<Vec3>& steps) {
  double along = 0, all = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double rho = window.landmarks[i].alpha_beta_rho.z(), information = points[i].V(2, 2);
    along -= information * rho * steps[i].z();
    all += information * rho * rho;
  }
  return all > 0 ? std::max(along / all, -kMostShrinking) : 0;
}

/// The variables of a window, without its measurements.
struct Estimate {
  std::vector<NavState<G>> states;
  std::vector<Vec3> landmarks;
  Calibration calibration;
  Tilt tilt;
  std::vector<OwnVariable> own;

  void save(const WindowProblem& window) {
    states.resize(window.frames.size());
    landmarks.resize(window.landmarks.size());
    for (std::size_t i = 0; i < states.size(); ++i) states[i] = window.frames[i].state;
    for (std::size_t i = 0; i < landmarks.size(); ++i) landmarks[i] = window.landmarks[i].alpha_beta_rho;
    calibration = window.calibration;
    tilt = window.tilt;
    own = window.own;
  }
  void restore(WindowProblem& window) const {
    for (std::size_t i = 0; i < states.size(); ++i) window.frames[i].state = states[i];
    for (std::size_t i = 0; i < landmarks.size(); ++i) window.landmarks[i].alpha_beta_rho = landmarks[i];
    window.calibration = calibration;
    window.tilt = tilt;
    window.own = own;
  }
};

void move(WindowProblem& window, const WindowLayout& at, const WindowStep& step, double scale) {
  const Eigen::VectorXd& d = step.dense;
  if (at.tilt_size > 0) window.tilt.angle_rad += d.segment<kTiltSize>(at.tilt_row());
  for (int i = 0; i < window.frame_count(); ++i) {
    Vec15 d_frame;
    d_frame << d.segment<6>(at.pose_row(i)), d.segment<9>(at.speed_bias_row(i));
    window.frames[i].state = window.frames[i].state.boxplus(d_frame);
  }
  for (std::size_t i = 0; i < window.landmarks.size(); ++i) {
    Vec3& l = window.landmarks[i].alpha_beta_rho;
    l.head<2>() += step.landmarks[i].head<2>();
    l.z() = (l.z() + step.landmarks[i].z() + scale * l.z()) / (1 + scale);
    l.z() = std::max(l.z(), window.weights.min_inverse_depth_1pm);
  }
  if (at.calibration_size > 0) window.move({Variable::Kind::calibration}, d.segment<kCalibrationSize>(at.calibration_row()));
  int row = at.own_row();
  for (OwnVariable& own : window.own) {
    own.value += d.segment(row, own.value.size());
    row += static_cast<int>(own.value.size());
  }
}

}  // namespace

bool WindowInformation::factorise(const WindowLayout& layout, const Eigen::MatrixXd& information) {
  layout_ = layout;
  valid_ = factor_.compute(information);
  return valid_;
}

std::optional<Mat17> WindowInformation::covariance(int frame) const {
  if (!valid_) return std::nullopt;
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(layout_.size(), 17);
  for (int k = 0; k < 15; ++k) unit(layout_.row_of(frame, k), k) = 1;
  for (int k = 0; k < layout_.tilt_size; ++k) unit(layout_.tilt_row() + k, 15 + k) = 1;
  factor_.solve_lower(unit);
  std::optional<Mat17> out(std::in_place);
  out->noalias() = unit.transpose() * unit;
  if (!out->allFinite()) return std::nullopt;
  return out;
}

std::optional<Mat17> WindowSolution::covariance(FrameId frame) const {
  const int index = window.index_of(frame);
  return index < 0 ? std::nullopt : information.covariance(index);
}

double WindowSolver::linearise(const WindowProblem& window) {
  images_show_scale_ = window.weights.images_show_scale;
  return fbvins::linearise(window, pairs_, equations_);
}

bool WindowSolver::step(double lambda, WindowInformation& information) {
  information.clear();
  if (reduced_.H.rows() != equations_.H.rows()) reduced_.H.setZero(equations_.H.rows(), equations_.H.cols());
  reduced_.H.triangularView<Eigen::Lower>() = equations_.H;
  reduced_.g = equations_.g;
  reduced_.H.diagonal() *= 1.0 + lambda;
  reduced_.H.diagonal().array() += kRegularisation;
  if (!equations_.points.eliminate(lambda, reduced_.H, reduced_.g, depth_damping(lambda))) return false;
  if (!information.factorise(equations_.layout, reduced_.H)) return false;
  return finish_step(lambda, information);
}

double WindowSolver::renew_gradient(const WindowProblem& window) { return gradient_of(window, pairs_, gradient_); }

bool WindowSolver::step_again(double lambda, const WindowInformation& information) {
  equations_.g = gradient_.dense;
  std::vector<PointBlock>& points = equations_.points.points();
  for (std::size_t i = 0; i < points.size(); ++i) points[i].w = gradient_.landmarks[i];
  reduced_.g = equations_.g;
  equations_.points.eliminate_gradient(reduced_.g);
  return finish_step(lambda, information);
}

ThirdDamping WindowSolver::depth_damping(double lambda) const { return {lambda > 0 ? kDepthDamping : 0.0, !images_show_scale_}; }

/// From the reduced gradient.
bool WindowSolver::finish_step(double lambda, const WindowInformation& information) {
  step_.dense = -information.solve(reduced_.g);
  equations_.points.back_substitute(step_.dense, step_.landmarks);
  if (!step_.dense.allFinite()) return false;

  // Predicted decrease of the damped quadratic model: (dx^T D dx - g^T dx) / 2.
  double twice = lambda * step_.dense.cwiseAbs2().dot(equations_.H.diagonal()) - equations_.g.dot(step_.dense);
  const ThirdDamping depth = depth_damping(lambda);
  for (std::size_t i = 0; i < step_.landmarks.size(); ++i) {
    const PointBlock& point = equations_.points.points()[i];
    const Vec3& d = step_.landmarks[i];
    twice += lambda * d.cwiseAbs2().dot(point.V.diagonal()) - point.w.dot(d) + depth.of(point) * d.z() * d.z();
  }
  step_.predicted_decrease = 0.5 * twice;
  step_.size = step_.dense.tail(6 * equations_.layout.frames).lpNorm<Eigen::Infinity>();
  return true;
}

/// The problem as minimise() expects it.
struct WindowSolver::Descent {
  WindowSolver& solver;
  WindowSolution& solution;
  Estimate before;
  double lambda = 0;  ///< of the last step

  double linearise() { return solver.linearise(solution.window); }
  bool solve(double damping) {
    lambda = damping;
    return solver.step(damping, solution.information);
  }
  double predicted_decrease() const { return solver.step_.predicted_decrease; }
  double step_size() const { return solver.step_.size; }
  /// One camera's scale is so weakly known that its information changes with each step.
  bool keeps_information() const { return solver.images_show_scale_ && !solution.window.calibrating(); }
  bool step_again() {
    return keeps_information() && lambda <= kNegligibleLambda && solver.step_again(lambda, solution.information);
  }
  double apply_step() {
    move();
    return keeps_information() ? solver.renew_gradient(solution.window) : cost_of(solution.window, solver.pairs_);
  }
  void move() {
    before.save(solution.window);
    const std::vector<PointBlock>& points = solver.equations_.points.points();
    const double scale = solver.images_show_scale_ ? 0 : common_scale(solution.window, points, solver.step_.landmarks);
    fbvins::move(solution.window, solver.equations_.layout, solver.step_, scale);
  }
  void undo_step() { before.restore(solution.window); }
};

void WindowSolver::solve(WindowSolution& solution, const LmOptions& options) {
  Descent descent{*this, solution, {}};
  solution.information.clear();
  solution.summary = minimise(descent, options);
  if (descent.lambda > kNegligibleLambda) (void)step(0, solution.information);  // damped covariances would be too small
}

}  // namespace fbvins
