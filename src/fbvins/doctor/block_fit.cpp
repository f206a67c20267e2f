// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/block_fit.hpp"

#include "fbvins/optim/dense_system.hpp"

namespace fbvins {

using Eigen::MatrixXd;
using Eigen::VectorXd;

BlockFit::BlockFit(const VectorXd& prior_sigma, double residual_sigma)
    : prior_((residual_sigma / prior_sigma.array()).square()),
      H_(kStretches, MatrixXd::Zero(prior_sigma.size(), prior_sigma.size())),
      g_(kStretches, VectorXd::Zero(prior_sigma.size())),
      sum_H_(H_[0]),
      sum_g_(g_[0]),
      used_(kStretches, 0) {}

void BlockFit::add(int stretch, const MatrixXd& H, const VectorXd& g) {
  const auto s = static_cast<std::size_t>(stretch);
  H_[s] += H;
  g_[s] += g;
  sum_H_ += H;
  sum_g_ += g;
  used_[s] = 1;
}

std::optional<VectorXd> BlockFit::solve_without(std::span<const int> free, int stretch) const {
  const auto n = static_cast<Eigen::Index>(free.size());
  MatrixXd H(n, n);
  VectorXd g(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int row = free[static_cast<std::size_t>(i)];
    g(i) = -sum_g_(row);
    if (stretch >= 0) g(i) += g_[static_cast<std::size_t>(stretch)](row);
    for (Eigen::Index j = 0; j < n; ++j) {
      const int column = free[static_cast<std::size_t>(j)];
      H(i, j) = sum_H_(row, column);
      if (stretch >= 0) H(i, j) -= H_[static_cast<std::size_t>(stretch)](row, column);
    }
    H(i, i) += prior_(row);
  }
  return solve_symmetric(H, g);
}

std::optional<BlockSolution> BlockFit::solve(std::span<const int> free) const {
  const std::optional<VectorXd> all = solve_without(free, -1);
  if (!all) return std::nullopt;
  BlockSolution solution;
  solution.x = VectorXd::Zero(sum_g_.size());
  for (std::size_t i = 0; i < free.size(); ++i) {
    const double x = (*all)(static_cast<Eigen::Index>(i));
    solution.x(free[i]) = x;
    solution.decrease -= 0.5 * x * sum_g_(free[i]);
  }
  std::vector<VectorXd> without;
  for (int stretch = 0; stretch < kStretches; ++stretch)
    if (used_[static_cast<std::size_t>(stretch)] != 0)
      if (auto x = solve_without(free, stretch)) without.push_back(std::move(*x));
  const auto n = static_cast<double>(without.size());
  solution.covariance = MatrixXd::Identity(all->size(), all->size()) * 1e12;
  if (without.size() < 4) return solution;
  VectorXd mean = VectorXd::Zero(all->size());
  for (const VectorXd& x : without) mean += x / n;
  solution.covariance.setZero();
  for (const VectorXd& x : without) solution.covariance += (n - 1) / n * (x - mean) * (x - mean).transpose();
  return solution;
}

}  // namespace fbvins
