// SPDX-License-Identifier: Apache-2.0
// Normal equations summed up in blocks, one for each stretch of the recording, and solved for any subset of the unknowns: one
// linearisation tells which single change explains most. Covariances are the jackknife's over the stretches, leaving out one
// at a time, which also sees errors that are correlated from image to image. Value; any thread.
//
//   BlockFit fit(prior_sigma, residual_sigma);
//   for (...) fit.add(stretch, H, g);
//   BlockSolution s = fit.solve({0, 1, 2});      // x[0..2] and their covariance; the others stay 0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace fbvins {

struct BlockSolution {
  Eigen::VectorXd x;           ///< of all unknowns; 0 for those that were not free
  Eigen::MatrixXd covariance;  ///< of the free ones, in their order, by the jackknife
  double decrease = 0;         ///< of half the sum of squares, to second order
};

class BlockFit {
 public:
  static constexpr int kStretches = 12;

  /// `prior_sigma`: of each unknown, about 0, so that one that is not observable stays there. `residual_sigma`: of one residual.
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

/// A hypothesis with one unknown moved by its step, for numeric derivatives.
template <class Hypothesis>
struct Moved {
  int unknown;
  double step;
  Hypothesis there;
};

template <class Hypothesis, class Start>
std::vector<Moved<Hypothesis>> moved_from(const Start& start, const Eigen::VectorXd& x, std::span<const int> free,
                                          const Eigen::VectorXd& steps) {
  std::vector<Moved<Hypothesis>> moved;
  for (const int i : free) moved.push_back({i, steps(i), Hypothesis(start, x + steps(i) * Eigen::VectorXd::Unit(x.size(), i))});
  return moved;
}

}  // namespace fbvins
