// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_equations.hpp"

#include <string_view>
#include <utility>

namespace fbvins {
namespace {

/// Relative damping with which a landmark is eliminated whose depth the observations leave open.
constexpr double kDampingOfSingular = 1e-5;

/// Returns its cost, and adds to the equations unless they are null.
double prior_term(const WindowProblem& w, NormalEquations* out) {
  const WindowPrior& prior = w.prior;
  if (prior.empty()) return 0;
  const Eigen::VectorXd dx = w.displacement(prior);
  if (out == nullptr) return prior.quadratic.cost(dx);
  const std::vector<int> rows = rows_of(w, out->layout, prior);
  const Eigen::VectorXd gradient = prior.quadratic.gradient(dx);
  for (int c = 0; c < prior.quadratic.size(); ++c) {
    out->g(rows[c]) += gradient(c);
    if (out->gradient_alone) continue;
    for (int r = 0; r < prior.quadratic.size(); ++r)
      if (rows[r] >= rows[c]) out->H(rows[r], rows[c]) += prior.quadratic.H(r, c);
  }
  return 0.5 * dx.dot(gradient + prior.quadratic.g);
}

/// Each kind is added up on its own first.
template <class OfFactor>
double sum_of_factors(const WindowProblem& w, double cost, const OfFactor& of) {
  std::string_view kind;
  double of_kind = 0;
  for (const std::shared_ptr<const Factor>& factor : w.factors) {
    if (factor->name() != kind) {
      cost += std::exchange(of_kind, 0);
      kind = factor->name();
    }
    of_kind += of(*factor);
  }
  return cost + of_kind;
}

/// All but what landmarks give.
double linearise_factors(const WindowProblem& window, NormalEquations& out) {
  out.layout = WindowLayout(window);
  const int n = out.layout.size();
  if (out.gradient_alone) out.H.resize(n, n);
  else out.H.setZero(n, n);
  out.g.setZero(n);
  return sum_of_factors(window, prior_term(window, &out), [&](const Factor& f) { return f.linearise(window, out); });
}

/// Rows of calibration that is not estimated, and of padding: decoupled, unit information, no gradient.
void fix_inactive_calibration(const WindowWeights& weights, NormalEquations& out) {
  const int begin = out.layout.calibration_row();
  for (int k = 0; k < kCalibrationSize; ++k) {
    if (k < kTimeOffsetIndex
            ? weights.estimate_extrinsics
            : (k == kTimeOffsetIndex && weights.estimate_time_offset) || (k == kLineDelayIndex && weights.estimate_line_delay))
      continue;
    out.H.row(begin + k).setZero();
    out.H.col(begin + k).setZero();
    out.H(begin + k, begin + k) = 1;
    out.g(begin + k) = 0;
    for (PointBlock& point : out.points.points()) out.points.coupling(point, k / 6).col(k % 6).setZero();
  }
}

}  // namespace

int row_of(const WindowProblem& window, const WindowLayout& at, const Variable& v) {
  switch (v.kind) {
    case Variable::Kind::pose: return at.pose_row(window.index_of(v.frame));
    case Variable::Kind::motion: return at.speed_bias_row(window.index_of(v.frame));
    case Variable::Kind::tilt: return at.tilt_row();
    case Variable::Kind::calibration: return at.calibration_row();
    case Variable::Kind::own: break;
  }
  int row = at.own_row();
  for (const OwnVariable& own : window.own) {
    if (own.number == v.own) break;
    row += static_cast<int>(own.value.size());
  }
  return row;
}

void add_residual(const WindowProblem& window, const std::vector<Variable>& variables, const Eigen::MatrixXd& J,
                  const Eigen::VectorXd& r, double weight, NormalEquations& out) {
  std::vector<int> rows;
  for (const Variable& v : variables)
    for (int k = 0; k < window.size_of(v); ++k) rows.push_back(row_of(window, out.layout, v) + k);
  const Eigen::VectorXd g = weight * J.transpose() * r;
  for (std::size_t i = 0; i < rows.size(); ++i) out.g(rows[i]) += g(static_cast<Eigen::Index>(i));
  if (out.gradient_alone) return;
  const Eigen::MatrixXd H = weight * J.transpose() * J;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = 0; k < rows.size(); ++k)
      if (rows[i] >= rows[k]) out.H(rows[i], rows[k]) += H(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
  }
}

std::vector<int> rows_of(const WindowProblem& window, const WindowLayout& at, const WindowPrior& prior) {
  std::vector<int> rows;
  rows.reserve(static_cast<std::size_t>(prior.frames_row()) + 15 * prior.frames.size());
  const auto add = [&](int begin, int size) {
    for (int k = 0; k < size; ++k) rows.push_back(begin + k);
  };
  if (prior.with_tilt) add(at.tilt_row(), kTiltSize);
  if (prior.with_calibration) add(at.calibration_row(), kCalibrationSize);
  for (const int number : prior.own)
    add(row_of(window, at, Variable::own_one(number)), window.size_of(Variable::own_one(number)));
  for (const int frame : prior.frames)
    for (int k = 0; k < 15; ++k) rows.push_back(at.row_of(frame, k));
  return rows;
}

void PairTable::fill(const WindowProblem& window, bool with_first_estimates) {
  n_ = window.frames.size();
  pairs_.resize(n_ * n_);
  for (std::size_t h = 0; h < n_; ++h) {
    for (std::size_t t = 0; t < n_; ++t) {
      PairGeometry& geometry = pairs_[h * n_ + t];
      geometry.set(window.frames[h].state.T_FB, window.frames[t].state.T_FB);
      if (with_first_estimates)
        geometry.set_first(window.linearisation_point(static_cast<int>(h)).T_FB,
                           window.linearisation_point(static_cast<int>(t)).T_FB);
    }
  }
}

double cost_of(const WindowProblem& window, PairTable& pairs) {
  pairs.fill(window, false);
  const double cost = sum_of_factors(window, prior_term(window, nullptr), [&](const Factor& f) { return f.cost(window); });
  return cost + landmark_cost(window, pairs);
}

double gradient_of(const WindowProblem& window, PairTable& pairs, WindowGradient& out) {
  out.of_factors.gradient_alone = true;
  pairs.fill(window, true);
  const double cost = linearise_factors(window, out.of_factors);
  out.dense = out.of_factors.g;
  return cost + add_landmark_gradient(window, pairs, out.of_factors.layout, out);
}

double linearise(const WindowProblem& window, PairTable& pairs, NormalEquations& out) {
  pairs.fill(window, true);
  const double of_factors = linearise_factors(window, out);
  out.points.clear();
  const double cost = of_factors + add_landmarks(window, pairs, out);
  if (window.calibrating()) fix_inactive_calibration(window.weights, out);
  return cost;
}

ReducedEquations reduced(NormalEquations& equations) {
  ReducedEquations out{equations.H, equations.g};
  if (!equations.points.eliminate(0, out.H, out.g)) {
    out = {equations.H, equations.g};
    equations.points.eliminate(kDampingOfSingular, out.H, out.g);
  }
  out.H = Eigen::MatrixXd(out.H.selfadjointView<Eigen::Lower>());
  return out;
}

}  // namespace fbvins
