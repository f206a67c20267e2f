// SPDX-License-Identifier: Apache-2.0
// Symmetric systems of any size, solved in one place: each use of Eigen's decomposition of its own costs seconds of compilation.
// Pure functions.
//
//   const auto x = solve_symmetric(H, b);
//   if (x) use(*x);
#pragma once

#include <Eigen/Core>
#include <optional>

namespace fbvins {

/// H^-1 b by LDL^T; none where something is not finite.
std::optional<Eigen::VectorXd> solve_symmetric(const Eigen::MatrixXd& H, const Eigen::VectorXd& b);

/// H^-1 by LDL^T; the same.
std::optional<Eigen::MatrixXd> invert_symmetric(const Eigen::MatrixXd& H);

struct SymmetricSolution {
  Eigen::VectorXd x;        ///< H^-1 b
  Eigen::MatrixXd inverse;  ///< H^-1
};
/// Both from one factor.
std::optional<SymmetricSolution> solve_and_invert_symmetric(const Eigen::MatrixXd& H, const Eigen::VectorXd& b);

}  // namespace fbvins
