// SPDX-License-Identifier: Apache-2.0
#include "fbvins/optim/dense_system.hpp"

#include <Eigen/Cholesky>

namespace fbvins {

namespace {

using Ldlt = Eigen::LDLT<Eigen::MatrixXd>;

std::optional<Eigen::VectorXd> solve(const Ldlt& ldlt, const Eigen::VectorXd& b) {
  Eigen::VectorXd x = ldlt.solve(b);
  if (ldlt.info() != Eigen::Success || !x.allFinite()) return std::nullopt;
  return x;
}

std::optional<Eigen::MatrixXd> invert(const Ldlt& ldlt) {
  Eigen::MatrixXd inverse = ldlt.solve(Eigen::MatrixXd::Identity(ldlt.rows(), ldlt.cols()));
  if (ldlt.info() != Eigen::Success || !inverse.allFinite()) return std::nullopt;
  return inverse;
}

}  // namespace

std::optional<Eigen::VectorXd> solve_symmetric(const Eigen::MatrixXd& H, const Eigen::VectorXd& b) { return solve(Ldlt(H), b); }

std::optional<Eigen::MatrixXd> invert_symmetric(const Eigen::MatrixXd& H) { return invert(Ldlt(H)); }

std::optional<SymmetricSolution> solve_and_invert_symmetric(const Eigen::MatrixXd& H, const Eigen::VectorXd& b) {
  const Ldlt ldlt(H);
  auto x = solve(ldlt, b);
  auto inverse = invert(ldlt);
  if (!x || !inverse) return std::nullopt;
  return SymmetricSolution{*std::move(x), *std::move(inverse)};
}

}  // namespace fbvins
