// SPDX-License-Identifier: Apache-2.0
#include "fbvins/optim/envelope_cholesky.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace envelope_cholesky_test {

/// Positive definite: a chain of `links` blocks of nine, then `dense` rows, each coupled to all columns from some block on.
Eigen::MatrixXd like_a_window(int links, int dense, Rng& rng) {
  const int n = 9 * links + dense;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n);
  for (int r = 0; r < n; ++r) {
    const int first = r < 9 * links ? std::max(0, r / 9 - 1) * 9 : std::min(9 * links, (r - 9 * links) / 6 * 9);
    for (int c = first; c < r; ++c) H(r, c) = rng.uniform(-1, 1);
    H(r, r) = 2.0 * n;
  }
  return H;
}

TEST(EnvelopeCholesky, FactorsAsADenseOneDoes) {
  Rng rng(1);
  for (const auto& [links, dense] : {std::pair{0, 1}, {0, 4}, {0, 13}, {1, 0}, {3, 20}, {11, 68}, {11, 86}, {16, 98}}) {
    const Eigen::MatrixXd H = like_a_window(links, dense, rng);
    const Eigen::MatrixXd expected = Eigen::LLT<Eigen::MatrixXd>(H).matrixL();
    EnvelopeCholesky factor;
    ASSERT_TRUE(factor.compute(H));
    EXPECT_LT((factor.lower() - expected).cwiseAbs().maxCoeff(), 1e-12) << links << " links, " << dense << " rows";
  }
}

TEST(EnvelopeCholesky, SolvesWhenReusedForOtherSizes) {
  Rng rng(2);
  EnvelopeCholesky factor;
  for (const int links : {11, 2, 5, 11}) {
    const Eigen::MatrixXd H = like_a_window(links, 6 * links + 2, rng);
    const Eigen::MatrixXd full = H.selfadjointView<Eigen::Lower>();
    ASSERT_TRUE(factor.compute(H));
    const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(H.rows(), -1, 2);
    EXPECT_LT((factor.solve(full * x) - x).norm(), 1e-10);
    Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(H.rows(), 3);
    unit(0, 0) = unit(H.rows() / 2, 1) = unit(H.rows() - 1, 2) = 1;
    Eigen::MatrixXd expected = unit;
    Eigen::LLT<Eigen::MatrixXd>(H).matrixL().solveInPlace(expected);
    factor.solve_lower(unit);
    EXPECT_LT((unit - expected).norm(), 1e-12);
  }
}

TEST(EnvelopeCholesky, RefusesWhatIsNotPositiveDefinite) {
  Rng rng(3);
  EnvelopeCholesky factor;
  for (const int bad : {0, 5, 40, 60}) {
    Eigen::MatrixXd H = like_a_window(5, 20, rng);
    for (const double value : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      H(bad, bad) = value;
      EXPECT_FALSE(factor.compute(H)) << bad << " " << value;
    }
  }
  EXPECT_TRUE(factor.compute(like_a_window(5, 20, rng))) << "usable again after a refusal";
}

}  // namespace envelope_cholesky_test
}  // namespace fbvins
