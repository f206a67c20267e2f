// SPDX-License-Identifier: Apache-2.0
#include "fbvins/optim/dense_system.hpp"

#include <Eigen/Cholesky>

namespace fbvins {

std::optional<Eigen::VectorXd> solve_symmetric(const Eigen::MatrixXd& H, const Eigen::VectorXd& b) {
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(H);
  Eigen::VectorXd x = ldlt.solve(b);
  if (ldlt.info() != Eigen::Success || !x.allFinite()) return std::nullopt;
  return x;
}

std::optional<Eigen::MatrixXd> invert_symmetric(const Eigen::MatrixXd& H) {
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(H);
  Eigen::MatrixXd inverse = ldlt.solve(Eigen::MatrixXd::Identity(H.rows(), H.cols()));
  if (ldlt.info() != Eigen::Success || !inverse.allFinite()) return std::nullopt;
  return inverse;
}

}  // namespace fbvins
