// SPDX-License-Identifier: Apache-2.0
#include "fbvins/optim/skyline_system.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fbvins {
namespace {

using Row = Eigen::Map<const Eigen::VectorXd>;

}  // namespace

SkylineSystem::SkylineSystem(std::vector<int> first) : first_(std::move(first)) {
  std::size_t offset = 0;
  for (std::size_t i = 0; i < first_.size(); ++i) {
    offset_.push_back(offset);
    offset += i - static_cast<std::size_t>(first_[i]) + 1;
  }
  H_.assign(offset, 0.0);
  b_ = Eigen::VectorXd::Zero(size());
}

void SkylineSystem::set_zero() {
  std::fill(H_.begin(), H_.end(), 0.0);
  b_.setZero();
}

void SkylineSystem::add(const std::vector<int>& index, const Eigen::MatrixXd& local, const Eigen::VectorXd& local_b) {
  const auto count = static_cast<Eigen::Index>(index.size());
  for (Eigen::Index c = 0; c < count; ++c) {
    const int column = index[static_cast<std::size_t>(c)];
    b_(column) += local_b(c);
    for (Eigen::Index r = 0; r < count; ++r) {
      const int row = index[static_cast<std::size_t>(r)];
      if (row < column) continue;
      assert(column >= first_[static_cast<std::size_t>(row)]);
      H_[at(row, column)] += local(r, c);
    }
  }
}

Eigen::VectorXd SkylineSystem::diagonal() const {
  Eigen::VectorXd d(size());
  for (int i = 0; i < size(); ++i) d(i) = H_[at(i, i)];
  return d;
}

bool SkylineSystem::factorise(double lambda) {
  L_ = H_;
  for (int i = 0; i < size(); ++i) {
    const int first = first_[static_cast<std::size_t>(i)];
    double* row = L_.data() + offset_[static_cast<std::size_t>(i)] - first;  // row[c] is L(i, c)
    for (int j = first; j < i; ++j) {
      const double* other = L_.data() + offset_[static_cast<std::size_t>(j)] - first_[static_cast<std::size_t>(j)];
      const int from = std::max(first, first_[static_cast<std::size_t>(j)]);
      row[j] = (row[j] - Row(row + from, j - from).dot(Row(other + from, j - from))) / other[j];
    }
    const double pivot = row[i] * (1 + lambda) - Row(row + first, i - first).squaredNorm();
    if (!(pivot > 0) || !std::isfinite(pivot)) return false;
    row[i] = std::sqrt(pivot);
  }
  return true;
}

Eigen::VectorXd SkylineSystem::solve(Eigen::VectorXd x) const {
  for (int i = 0; i < size(); ++i) {
    const int first = first_[static_cast<std::size_t>(i)];
    const double* row = L_.data() + offset_[static_cast<std::size_t>(i)];
    x(i) = (x(i) - Row(row, i - first).dot(x.segment(first, i - first))) / row[i - first];
  }
  for (int i = size() - 1; i >= 0; --i) {
    const int first = first_[static_cast<std::size_t>(i)];
    const double* row = L_.data() + offset_[static_cast<std::size_t>(i)];
    x(i) /= row[i - first];
    x.segment(first, i - first) -= x(i) * Row(row, i - first);
  }
  return x;
}

Eigen::MatrixXd SkylineSystem::inverse_tail(int count) const {
  // H^-1 = L^-T L^-1, and of L^-1's last rows only the last columns enter the block.
  const int begin = size() - count;
  Eigen::MatrixXd L = Eigen::MatrixXd::Zero(count, count);
  for (int i = 0; i < count; ++i)
    for (int j = std::max(0, first_[static_cast<std::size_t>(begin + i)] - begin); j <= i; ++j)
      L(i, j) = L_[at(begin + i, begin + j)];
  const Eigen::MatrixXd inverse = L.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(count, count));
  return inverse.transpose() * inverse;
}

}  // namespace fbvins
