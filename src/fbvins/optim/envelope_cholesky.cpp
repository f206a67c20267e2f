// SPDX-License-Identifier: Apache-2.0
#include "fbvins/optim/envelope_cholesky.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/lanes.hpp"

namespace fbvins {
namespace {

// Rows of L are computed four at a time, from their first non-zero entry to the diagonal, eight columns at a time.
constexpr int kRows = 4, kWidth = 8;
using PanelRow = Lanes<double, kWidth>;

struct Matrix {
  double* L;
  std::ptrdiff_t stride;
  double* inverse_diagonal;
};

/// The rest of a panel that lies below the diagonal, column by column.
FBVINS_INLINE void finish_below(const Matrix& m, int i, int k, PanelRow (&a)[kRows]) {
#pragma GCC unroll 8
  for (int c = 0; c < kWidth; ++c) {
    double* column = m.L + (k + c) * m.stride;
    PanelRow v;
    load_lanes(column + k, v);
#pragma GCC unroll 4
    for (int r = 0; r < kRows; ++r) {
      column[i + r] = a[r].part[c / PanelRow::kInPart][c % PanelRow::kInPart] * m.inverse_diagonal[k + c];
      a[r] -= column[i + r] * v;
    }
  }
}

/// The rest of a panel that the diagonal crosses. False without a positive pivot.
FBVINS_INLINE bool finish_across(const Matrix& m, int i, int k, int rows, double (&a)[kRows][kWidth]) {
  for (int c = 0; c < kWidth && k + c < i + rows; ++c) {
    double* column = m.L + (k + c) * m.stride;
    if (const int r = k + c - i; r >= 0) {
      const double d = a[r][c];
      if (!(d > 0) || !std::isfinite(d)) return false;
      column[k + c] = std::sqrt(d);
      m.inverse_diagonal[k + c] = 1 / column[k + c];
    }
    const int below = std::max(0, k + c + 1 - i);
    for (int r = below; r < kRows; ++r) column[i + r] = a[r][c] * m.inverse_diagonal[k + c];
    PanelRow v, rest;
    load_lanes(column + k, v);
    for (int r = below; r < kRows; ++r) {
      load_lanes(a[r], rest);
      rest -= column[i + r] * v;
      store_lanes(rest, a[r]);
    }
  }
  return true;
}

/// L in rows i .. i + 3 and columns k .. k + 7, from the finished columns `first` .. k - 1. False without a positive pivot.
FBVINS_KERNEL bool make_panel(const Matrix& m, int i, int k, int first, int rows) {
  double in_memory[kRows][kWidth];
  for (int r = 0; r < kRows; ++r)
    for (int c = 0; c < kWidth; ++c) in_memory[r][c] = m.L[(k + c) * m.stride + i + r];
  PanelRow a[kRows];
#pragma GCC unroll 4
  for (int r = 0; r < kRows; ++r) load_lanes(in_memory[r], a[r]);
  for (int j = first; j < k; ++j) {
    const double* column = m.L + j * m.stride;
    PanelRow v;
    load_lanes(column + k, v);
#pragma GCC unroll 4
    for (int r = 0; r < kRows; ++r) a[r] -= column[i + r] * v;
  }
  if (k + kWidth <= i) {
    finish_below(m, i, k, a);
    return true;
  }
#pragma GCC unroll 4
  for (int r = 0; r < kRows; ++r) store_lanes(a[r], in_memory[r]);
  return finish_across(m, i, k, rows, in_memory);
}

/// x = L^-1 x, where x is zero before `from`; x has as many numbers as a column of L. kWidth at a time, so that they stay in
/// registers while the finished ones are subtracted.
FBVINS_KERNEL void substitute_forward(const double* L, std::ptrdiff_t stride, const double* inverse_diagonal, int size, int from,
                                      double* x) {
  for (int i = from / kWidth * kWidth; i < size; i += kWidth) {
    PanelRow rest, v;
    load_lanes(x + i, rest);
    for (int k = from; k < i; ++k) {
      load_lanes(L + k * stride + i, v);
      rest -= x[k] * v;
    }
#pragma GCC unroll 8
    for (int c = 0; c < kWidth; ++c) {
      x[i + c] = rest.part[c / PanelRow::kInPart][c % PanelRow::kInPart] * inverse_diagonal[i + c];
      load_lanes(L + (i + c) * stride + i, v);
      rest -= x[i + c] * v;
    }
  }
}

FBVINS_KERNEL double dot(const double* a, const double* b, int count) {  // padded with zeros to whole lanes
  PanelRow sum{};
  for (int i = 0; i < count; i += kWidth) {
    PanelRow u, v;
    load_lanes(a + i, u);
    load_lanes(b + i, v);
    sum += u * v;
  }
  double s[kWidth];
  store_lanes(sum, s);
  return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
}

constexpr int padded(int n) { return (n + kWidth - 1) / kWidth * kWidth; }

}  // namespace

bool EnvelopeCholesky::compute(const Eigen::MatrixXd& H) {
  size_ = static_cast<int>(H.rows());
  stride_ = padded(size_) + kWidth;
  L_.resize(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(padded(size_) + kWidth));
  inverse_diagonal_.assign(static_cast<std::size_t>(padded(size_)), 0.0);
  first_.assign(static_cast<std::size_t>(padded(size_) + kRows), size_);
  std::fill(L_.begin() + static_cast<std::ptrdiff_t>(size_) * stride_, L_.end(), 0.0);
  for (int c = 0; c < size_; ++c) {
    const double* from = H.data() + static_cast<std::ptrdiff_t>(c) * H.outerStride();
    double* to = L_.data() + static_cast<std::ptrdiff_t>(c) * stride_;
    std::copy(from + c, from + size_, to + c);
    std::fill(to + size_, to + stride_, 0.0);
    for (int r = c; r < size_; ++r)
      if (from[r] != 0 && first_[static_cast<std::size_t>(r)] > c) first_[static_cast<std::size_t>(r)] = c;
  }
  const auto first_of = [&](int row, int count) { return *std::min_element(first_.begin() + row, first_.begin() + row + count); };
  const Matrix m{L_.data(), stride_, inverse_diagonal_.data()};
  for (int i = 0; i < size_; i += kRows) {
    const int rows = std::min(kRows, size_ - i), first = std::min(first_of(i, rows), i);
    for (int k = first / kWidth * kWidth; k < i + rows; k += kWidth) {
      const int from = std::max(first, std::min(first_of(k, std::min(kWidth, size_ - k)), k));
      if (!make_panel(m, i, k, from, rows)) return false;
    }
  }
  return true;
}

void EnvelopeCholesky::forward(double* x, int from) const {
  substitute_forward(L_.data(), stride_, inverse_diagonal_.data(), size_, from, x);
}

Eigen::VectorXd EnvelopeCholesky::solve(Eigen::VectorXd b) const {
  std::vector<double> x(static_cast<std::size_t>(stride_), 0.0);
  std::copy(b.data(), b.data() + size_, x.begin());
  forward(x.data(), 0);
  for (int k = size_ - 1; k >= 0; --k) {
    double& value = x[static_cast<std::size_t>(k)];
    value = (value - dot(column(k) + k + 1, x.data() + k + 1, size_ - k - 1)) * inverse_diagonal_[static_cast<std::size_t>(k)];
  }
  std::copy(x.begin(), x.begin() + size_, b.data());
  return b;
}

void EnvelopeCholesky::solve_lower(Eigen::MatrixXd& X) const {
  std::vector<double> x(static_cast<std::size_t>(stride_), 0.0);
  for (int c = 0; c < X.cols(); ++c) {
    double* column = X.data() + static_cast<std::ptrdiff_t>(c) * X.outerStride();
    std::copy(column, column + size_, x.begin());
    forward(x.data(), static_cast<int>(std::find_if(column, column + size_, [](double v) { return v != 0; }) - column));
    std::copy(x.begin(), x.begin() + size_, column);
  }
}

Eigen::MatrixXd EnvelopeCholesky::lower() const {
  Eigen::MatrixXd L = Eigen::MatrixXd::Zero(size_, size_);
  for (int c = 0; c < size_; ++c)
    for (int r = c; r < size_; ++r) L(r, c) = column(c)[r];
  return L;
}

}  // namespace fbvins
