// SPDX-License-Identifier: Apache-2.0
// A least-squares problem summed up in blocks, one a stretch of the recording, and solved for any subset of its unknowns: which
// single change explains most is asked of one linearisation, and how well it is known is what the stretches say of it
// one without another (a jackknife), which also sees errors that repeat from image to image. Value; any thread.
//
//   BlockFit fit(unknowns, prior_sigmas);
//   for (...) fit.add(stretch, H, g, cost);
//   BlockSolution s = fit.solve({0, 1, 2});      // x[0..2] and their covariance; the others stay 0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace fbvins {

struct BlockSolution {
  Eigen::VectorXd x;           ///< one an unknown; 0 where it was not free
  Eigen::MatrixXd covariance;  ///< of the free ones, in their order, by the jackknife
  double decrease = 0;         ///< of half the sum of squares, to second order
};

class BlockFit {
 public:
  static constexpr int kStretches = 12;

  /// Standard deviations within which unknowns stay that nothing is seen of.
  BlockFit(const Eigen::VectorXd& prior_sigma, double residual_sigma);

  /// Half of the sum of squares is cost + g^T x + x^T H x / 2 for what belongs to `stretch`, 0 <= stretch < kStretches.
  void add(int stretch, const Eigen::MatrixXd& H, const Eigen::VectorXd& g);

  std::optional<BlockSolution> solve(std::span<const int> free) const;

 private:
  std::optional<Eigen::VectorXd> solve_without(std::span<const int> free, int stretch) const;

  Eigen::VectorXd prior_;
  std::vector<Eigen::MatrixXd> H_;
  std::vector<Eigen::VectorXd> g_;
  Eigen::MatrixXd sum_H_;
  Eigen::VectorXd sum_g_;
  std::vector<int> used_;
};

}  // namespace fbvins
