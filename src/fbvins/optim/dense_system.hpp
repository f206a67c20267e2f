// SPDX-License-Identifier: Apache-2.0
// Symmetric systems of any size, solved in one place, because each source file that instantiates Eigen's decomposition
// takes seconds longer to compile. Pure functions.
//
//   const auto x = solve_symmetric(H, b);
//   if (x) use(*x);
#pragma once

#include <Eigen/Core>
#include <optional>

namespace fbvins {

/// H^-1 b by LDL^T; none where the result is not finite.
std::optional<Eigen::VectorXd> solve_symmetric(const Eigen::MatrixXd& H, const Eigen::VectorXd& b);

/// H^-1 by LDL^T; none where the result is not finite.
std::optional<Eigen::MatrixXd> invert_symmetric(const Eigen::MatrixXd& H);

struct SymmetricSolution {
  Eigen::VectorXd x;        ///< H^-1 b
  Eigen::MatrixXd inverse;  ///< H^-1
};
/// Both from one factor.
std::optional<SymmetricSolution> solve_and_invert_symmetric(const Eigen::MatrixXd& H, const Eigen::VectorXd& b);

}  // namespace fbvins
