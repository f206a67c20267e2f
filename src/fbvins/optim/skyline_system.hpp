// SPDX-License-Identifier: Apache-2.0
// Normal equations H x = b of a long chain of unknowns, each coupled to its neighbours, and of a few that are coupled to all:
// of each row only what lies between its first entry and the diagonal is stored, and with the few at the end the factor fills
// nothing else. Cost: linear in the chain's length. A value; one owner.
//
//   SkylineSystem system(first);               // first[i]: column of row i's first entry, at most i
//   system.add(indices, J.transpose() * J, J.transpose() * r);
//   if (system.factorise(lambda)) x = system.solve(system.b());
//   P = system.inverse_tail(24);               // covariance of the last 24 unknowns
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace fbvins {

class SkylineSystem {
 public:
  explicit SkylineSystem(std::vector<int> first);

  int size() const { return static_cast<int>(first_.size()); }
  void set_zero();
  /// H(index, index) += local, b(index) += local_b. The indices differ from one another; `local` is symmetric.
  void add(const std::vector<int>& index, const Eigen::MatrixXd& local, const Eigen::VectorXd& local_b);

  const Eigen::VectorXd& b() const { return b_; }
  Eigen::VectorXd diagonal() const;
  /// L L^T = H + lambda diag(H); false where that is not positive definite or not finite.
  bool factorise(double lambda = 0);
  Eigen::VectorXd solve(Eigen::VectorXd rhs) const;
  /// Lower right block of H^-1.
  Eigen::MatrixXd inverse_tail(int count) const;

 private:
  std::size_t at(int row, int column) const {
    return offset_[static_cast<std::size_t>(row)] + static_cast<std::size_t>(column - first_[static_cast<std::size_t>(row)]);
  }

  std::vector<int> first_;
  std::vector<std::size_t> offset_;
  std::vector<double> H_, L_;
  Eigen::VectorXd b_;
};

}  // namespace fbvins
