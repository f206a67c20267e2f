// SPDX-License-Identifier: Apache-2.0
// Symmetric systems of a few unknowns, each size compiled once: in every source that has Eigen solve one in place, a size takes
// the compiler one to four seconds. The same bits as in place. Pure functions.
//
//   const Vec6 step = Ldlt<6>(H).solve(g);
#pragma once

#include <Eigen/Cholesky>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {

/// A = L D L^T of the lower triangle of A, with pivots.
template <int N>
class Ldlt {
 public:
  using Matrix = Eigen::Matrix<double, N, N>;

  explicit Ldlt(const Matrix& A);
  bool succeeded() const;
  double least_pivot() const;
  /// A^-1 b; of matrices that ldlt.cpp names. The last bits depend on the order in which b is stored.
  template <class Right>
  Right solve(const Right& b) const;

 private:
  Eigen::LDLT<Matrix> factor_;
};

/// By LU, as Eigen's inverse().
Mat6 inverted(const Mat6& A);

/// U of A = U^T U.
Mat6 upper_cholesky(const Mat6& A);
bool is_positive_definite(const Mat6& A);

}  // namespace fbvins
