// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/svd3.hpp"

#include <Eigen/SVD>

namespace fbvins {

Svd3 svd3(const Mat3& A) {
  const Eigen::JacobiSVD<Mat3> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.matrixV(), svd.singularValues()};
}

}  // namespace fbvins
