// SPDX-License-Identifier: Apache-2.0
// Singular values of a 3 x 3 matrix, compiled once, with the bits of Eigen's in place. A pure function.
//
//   const Svd3 svd = svd3(A);   // A = U diag(values) V^T
#pragma once

#include "fbvins/geometry/so3.hpp"

namespace fbvins {

struct Svd3 {
  Mat3 U, V;
  Vec3 values;  ///< the largest first
};

Svd3 svd3(const Mat3& A);

}  // namespace fbvins
