// SPDX-License-Identifier: Apache-2.0
// Marginalisation: the information of variables that leave an optimisation on those that stay, as a quadratic prior.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace fbvins {

/// cost(dx) = dx^T H dx / 2 + g^T dx, dx measured from the linearisation point.
struct QuadraticPrior {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;

  int size() const { return static_cast<int>(g.size()); }
  double cost(const Eigen::VectorXd& dx) const { return 0.5 * dx.dot(H * dx) + g.dot(dx); }
  Eigen::VectorXd gradient(const Eigen::VectorXd& dx) const { return H * dx + g; }
};

/// Eliminates the variables `drop` (Schur complement); the result is over `keep`, in its order.
/// Directions of `drop` without information are left out (pseudo-inverse, relative threshold
/// 1e-12 after scaling to unit diagonal): no information passes through them.
QuadraticPrior marginalise(const Eigen::MatrixXd& H, const Eigen::VectorXd& g, const std::vector<int>& keep,
                           const std::vector<int>& drop);

/// Moves the linearisation point by dx: the same quadratic, measured from the new point.
QuadraticPrior shifted(QuadraticPrior prior, const Eigen::VectorXd& dx);

}  // namespace fbvins
