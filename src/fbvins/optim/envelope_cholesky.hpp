// SPDX-License-Identifier: Apache-2.0
// Cholesky factor of a symmetric positive definite matrix whose rows begin with zeros: the zeros before a row's first non-zero
// entry cost nothing. A window's velocities and biases, each coupled to its neighbours only, come before its poses: a quarter
// of the dense work is left. The same bits on every instruction set. A value; reuses its memory.
//
//   EnvelopeCholesky factor;
//   if (factor.compute(H)) x = factor.solve(b);          // of H, the lower triangle is read
#pragma once

#include <Eigen/Core>
#include <vector>

namespace fbvins {

class EnvelopeCholesky {
 public:
  /// H = L L^T; false where H is not positive definite or not finite.
  bool compute(const Eigen::MatrixXd& H);
  /// H^-1 b.
  Eigen::VectorXd solve(Eigen::VectorXd b) const;
  /// L^-1 X in place; each column from its first non-zero entry on.
  void solve_lower(Eigen::MatrixXd& X) const;
  /// L, for tests.
  Eigen::MatrixXd lower() const;

 private:
  const double* column(int c) const { return L_.data() + static_cast<std::ptrdiff_t>(c) * stride_; }
  void forward(double* x, int from) const;

  int size_ = 0, stride_ = 0;
  std::vector<double> L_;  ///< column by column, rows padded to whole lanes
  std::vector<double> inverse_diagonal_;
  std::vector<int> first_;  ///< column of each row's first non-zero entry
};

}  // namespace fbvins
