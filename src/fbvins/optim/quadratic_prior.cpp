// SPDX-License-Identifier: Apache-2.0
#include "fbvins/optim/quadratic_prior.hpp"

#include <Eigen/Eigenvalues>

namespace fbvins {
namespace {

Eigen::MatrixXd pick(const Eigen::MatrixXd& H, const std::vector<int>& rows, const std::vector<int>& cols) {
  Eigen::MatrixXd out(rows.size(), cols.size());
  for (std::size_t c = 0; c < cols.size(); ++c)
    for (std::size_t r = 0; r < rows.size(); ++r) out(r, c) = H(rows[r], cols[c]);
  return out;
}

Eigen::VectorXd pick(const Eigen::VectorXd& g, const std::vector<int>& rows) {
  Eigen::VectorXd out(rows.size());
  for (std::size_t r = 0; r < rows.size(); ++r) out(r) = g(rows[r]);
  return out;
}

}  // namespace

QuadraticPrior marginalise(const Eigen::MatrixXd& H, const Eigen::VectorXd& g, const std::vector<int>& keep,
                           const std::vector<int>& drop) {
  QuadraticPrior out{pick(H, keep, keep), pick(g, keep)};
  if (drop.empty()) return out;
  Eigen::MatrixXd Hdd = pick(H, drop, drop);
  // Unit diagonal first: metres, radians and biases differ by many orders of magnitude.
  const Eigen::VectorXd scale = Hdd.diagonal().unaryExpr([](double d) { return d > 0 ? 1.0 / std::sqrt(d) : 0.0; });
  Hdd = scale.asDiagonal() * Hdd * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(0.5 * (Hdd + Hdd.transpose()));
  const double threshold = 1e-12 * eigen.eigenvalues().tail(1)(0);
  const Eigen::VectorXd root = eigen.eigenvalues().unaryExpr([&](double e) { return e > threshold ? 1.0 / std::sqrt(e) : 0.0; });
  // half^T half = Hdd^-1: a product of that form is symmetric and positive semidefinite in spite of rounding.
  const Eigen::MatrixXd half = root.asDiagonal() * eigen.eigenvectors().transpose() * scale.asDiagonal();
  const Eigen::MatrixXd coupling = half * pick(H, drop, keep);
  out.H.noalias() -= coupling.transpose() * coupling;
  out.g.noalias() -= coupling.transpose() * (half * pick(g, drop));
  out.H = (0.5 * (out.H + out.H.transpose())).eval();
  return out;
}

QuadraticPrior shifted(QuadraticPrior prior, const Eigen::VectorXd& dx) {
  prior.g += prior.H * dx;
  return prior;
}

}  // namespace fbvins
