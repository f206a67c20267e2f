// SPDX-License-Identifier: Apache-2.0
// For tests: what must be true of any factor, whatever it measures. Derivatives against differences of the cost; nothing is added
// to rows of variables that it does not name; information is positive semidefinite and in the lower triangle.
//
//   expect_sound(MyFactor(...), test::make_window(false).problem);
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <string>
#include <vector>

#include "fbvins/estimator/window_equations.hpp"
#include "tests/support/jacobian_check.hpp"

namespace fbvins::test {

/// Equations of the window's size, all zero.
inline NormalEquations empty_equations(const WindowProblem& window) {
  NormalEquations out;
  out.layout = WindowLayout(window);
  out.H.setZero(out.layout.size(), out.layout.size());
  out.g.setZero(out.layout.size());
  return out;
}

/// Of the factor's variables, in their order.
struct FactorRows {
  std::vector<int> rows;
  std::vector<JacobianBlock> blocks;
};
inline FactorRows rows_of(const Factor& factor, const WindowProblem& window, const WindowLayout& at) {
  FactorRows out;
  const char* const kinds[] = {"pose", "motion", "tilt", "calibration", "own variable"};
  for (const Variable& v : factor.variables()) {
    const int begin = fbvins::row_of(window, at, v), size = window.size_of(v);
    for (int k = 0; k < size; ++k) out.rows.push_back(begin + k);
    if (size > 0)
      out.blocks.push_back({std::string(kinds[static_cast<int>(v.kind)]) + " " + std::to_string(v.frame.value), size});
  }
  return out;
}

/// The window after a step of the factor's variables.
inline WindowProblem moved(const Factor& factor, WindowProblem window, const Eigen::VectorXd& step) {
  int at = 0;
  for (const Variable& v : factor.variables()) {
    const int size = window.size_of(v);
    if (size > 0) window.move(v, step.segment(at, size));
    at += size;
  }
  return window;
}

/// In words what is wrong; empty: nothing.
inline std::string unsound(const Factor& factor, const WindowProblem& window) {
  NormalEquations equations = empty_equations(window);
  const double cost = factor.linearise(window, equations);
  if (!(std::abs(cost - factor.cost(window)) <= 1e-9 * (1 + cost))) return "cost() and linearise() disagree";
  const FactorRows at = rows_of(factor, window, equations.layout);
  const int n = static_cast<int>(at.rows.size());
  Eigen::VectorXd g(n);
  Eigen::MatrixXd H(n, n);
  const Eigen::MatrixXd whole = equations.H.selfadjointView<Eigen::Lower>();
  for (int i = 0; i < n; ++i) {
    g(i) = equations.g(at.rows[i]);
    for (int j = 0; j < n; ++j) H(i, j) = whole(at.rows[i], at.rows[j]);
  }
  if (std::abs(g.squaredNorm() - equations.g.squaredNorm()) > 1e-9 * equations.g.squaredNorm())
    return "gradient in rows of variables that it does not name";
  if (std::abs(H.squaredNorm() - whole.squaredNorm()) > 1e-9 * whole.squaredNorm())
    return "information in rows of variables that it does not name";
  if (Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(H).eigenvalues().minCoeff() < -1e-9 * H.norm())
    return "information is not positive semidefinite";
  const auto cost_after = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    return Eigen::VectorXd::Constant(1, factor.cost(moved(factor, window, d)));
  };
  const JacobianCheck check = check_jacobian(cost_after, g.transpose(), {{"cost", 1}}, at.blocks, 1e-6, 1e-5);
  return check.ok ? "" : check.message;
}

inline void expect_sound(const Factor& factor, const WindowProblem& window) {
  EXPECT_EQ(unsound(factor, window), "") << factor.name();
}

}  // namespace fbvins::test
