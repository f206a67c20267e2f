// SPDX-License-Identifier: Apache-2.0
// For tests: compares an analytic Jacobian with central differences and names the block that differs most.
//
//   const auto check = check_jacobian(
//       [&](const Eigen::VectorXd& d) { return residual(state.boxplus(d)); }, J,
//       {{"r_p", 3}, {"r_theta", 3}}, {{"position", 3}, {"rotation", 3}});
//   EXPECT_TRUE(check.ok) << check.message;
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace fbvins {

/// A named range of rows or columns; the blocks are consecutive and cover the matrix.
struct JacobianBlock {
  std::string name;
  int size = 0;
};

struct JacobianCheck {
  bool ok = false;
  double worst = 0;     ///< largest error, relative to the larger of 1 and the block's largest entry
  std::string message;  ///< names the worst block: "d r_theta / d rotation: ..."
};

/// Derivative of f at zero by central differences of fourth order with the given step.
inline Eigen::MatrixXd numeric_jacobian(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f, int columns,
                                        double step = 1e-3) {
  Eigen::MatrixXd J;
  for (int c = 0; c < columns; ++c) {
    const auto at = [&](double x) { return f(x * Eigen::VectorXd::Unit(columns, c)); };
    const Eigen::VectorXd d = (8 * (at(step) - at(-step)) - (at(2 * step) - at(-2 * step))) / (12 * step);
    if (c == 0) J.resize(d.size(), columns);
    J.col(c) = d;
  }
  return J;
}

inline JacobianCheck check_jacobian(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f,
                                    const Eigen::MatrixXd& analytic, const std::vector<JacobianBlock>& rows,
                                    const std::vector<JacobianBlock>& columns, double tolerance = 1e-7, double step = 1e-3) {
  JacobianCheck check;
  const Eigen::MatrixXd numeric = numeric_jacobian(f, static_cast<int>(analytic.cols()), step);
  if (numeric.rows() != analytic.rows()) {
    check.message = fmt::format("{} rows, but the residual has {}", analytic.rows(), numeric.rows());
    return check;
  }
  int row = 0, covered_rows = 0, covered_columns = 0;
  for (const JacobianBlock& r : rows) covered_rows += r.size;
  for (const JacobianBlock& c : columns) covered_columns += c.size;
  if (covered_rows != analytic.rows() || covered_columns != analytic.cols()) {
    check.message =
        fmt::format("the named blocks cover {}x{} of {}x{}", covered_rows, covered_columns, analytic.rows(), analytic.cols());
    return check;
  }
  for (const JacobianBlock& r : rows) {
    int column = 0;
    for (const JacobianBlock& c : columns) {
      const auto a = analytic.block(row, column, r.size, c.size);
      const auto n = numeric.block(row, column, r.size, c.size);
      const bool finite = a.allFinite() && n.allFinite();
      const double error = finite ? (a - n).cwiseAbs().maxCoeff() / std::max(1.0, n.cwiseAbs().maxCoeff())
                                  : std::numeric_limits<double>::infinity();
      if (error > check.worst) {
        check.worst = error;
        check.message = fmt::format("d {} / d {}: error {:.3g}, analytic norm {:.6g}, numeric norm {:.6g}", r.name, c.name, error,
                                    a.norm(), n.norm());
      }
      column += c.size;
    }
    row += r.size;
  }
  check.ok = check.worst <= tolerance;
  return check;
}

}  // namespace fbvins
