// SPDX-License-Identifier: Apache-2.0
#include "fbvins/optim/schur.hpp"

#include <Eigen/LU>

#include "fbvins/core/lanes.hpp"

namespace fbvins {
namespace {

/// Columns of H that one pass over W V^-1 serves.
constexpr int kColumns = 3;

/// out -= y w^T in `Rows` rows and kColumns columns; y has three columns `length` apart.
template <int Rows>
FBVINS_INLINE void subtract_rows(const double* y, std::ptrdiff_t length, const double* w, double* out, std::ptrdiff_t ld) {
  Lanes<double, Rows> y0, y1, y2, x;
  load_lanes(y, y0);
  load_lanes(y + length, y1);
  load_lanes(y + 2 * length, y2);
  for (int c = 0; c < kColumns; ++c) {
    load_lanes(out + c * ld, x);
    x -= y0 * w[3 * c] + y1 * w[3 * c + 1] + y2 * w[3 * c + 2];
    store_lanes(x, out + c * ld);
  }
}

/// Subtracts W_k V^-1 W_l^T for all pairs of one point's blocks from the lower triangle of H.
/// y is W V^-1 (6 count x 3), w is W^T (3 x 6 count), both column-major.
FBVINS_KERNEL void subtract_outer_products(double* H, std::ptrdiff_t ld, const int* offsets, int count, const double* y,
                                           const double* w) {
  const int length = 6 * count;
  for (int b = 0; b < count; ++b) {
    for (int a = b; a < count;) {
      int end = a + 1;  // blocks that are adjacent in the system are done in one long run
      while (end < count && offsets[end] == offsets[end - 1] + 6) ++end;
      const int n = 6 * (end - a), whole = n / 4 * 4;
      for (int j = 0; j < 6; j += kColumns) {
        double* out = H + (offsets[b] + j) * ld + offsets[a];
        const double *of_run = y + 6 * a, *of_columns = w + 18 * b + 3 * j;
        for (int i = 0; i < whole; i += 4) subtract_rows<4>(of_run + i, length, of_columns, out + i, ld);
        if (whole < n) subtract_rows<2>(of_run + whole, length, of_columns, out + whole, ld);
      }
      a = end;
    }
  }
}

/// y = W V^-1 (rows x 3), column-major, from w = W^T (3 x rows).
FBVINS_KERNEL void times_inverse(const double* w, int rows, const double* V_inverse, double* y) {
  for (int c = 0; c < 3; ++c)
    for (int i = 0; i < rows; ++i)
      y[c * rows + i] = w[3 * i] * V_inverse[3 * c] + w[3 * i + 1] * V_inverse[3 * c + 1] + w[3 * i + 2] * V_inverse[3 * c + 2];
}

}  // namespace

PointBlock& PointBlocks::add(std::span<const int> offsets) {
  PointBlock point;
  point.V.setZero();
  point.w.setZero();
  point.V_inverse.setZero();
  point.first = static_cast<int>(offsets_.size());
  point.count = static_cast<int>(offsets.size());
  offsets_.insert(offsets_.end(), offsets.begin(), offsets.end());
  coupling_.resize(18 * offsets_.size(), 0.0);
  points_.push_back(point);
  return points_.back();
}

bool PointBlocks::eliminate(double lambda, Eigen::MatrixXd& H, Eigen::VectorXd& g, const ThirdDamping& third) {
  for (PointBlock& point : points_) {
    Eigen::Matrix3d V = point.V;
    V.diagonal() *= 1.0 + lambda;
    V(2, 2) += third.of(point);
    bool invertible = false;
    double determinant = 0;
    const double scale = V(0, 0) * V(1, 1) * V(2, 2);
    V.computeInverseAndDetWithCheck(point.V_inverse, determinant, invertible, 1e-13 * scale);
    if (!invertible || !(determinant > 0)) return false;
    const int n = point.count;
    if (n == 0) continue;
    scratch_.resize(18 * n);
    const double* W = coupling_.data() + 18 * point.first;
    const int* offsets = offsets_.data() + point.first;
    const Eigen::Vector3d v_inv_w = point.V_inverse * point.w;
    const Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>> WT(W, 3, 6 * n);
    times_inverse(W, 6 * n, point.V_inverse.data(), scratch_.data());
    for (int k = 0; k < n; ++k) g.segment<6>(offsets[k]).noalias() -= WT.middleCols<6>(6 * k).transpose() * v_inv_w;
    subtract_outer_products(H.data(), H.outerStride(), offsets, n, scratch_.data(), W);
  }
  return true;
}

void PointBlocks::eliminate_gradient(Eigen::VectorXd& g) const {
  for (const PointBlock& point : points_) {
    const Eigen::Vector3d v_inv_w = point.V_inverse * point.w;
    for (int k = 0; k < point.count; ++k) {
      const Eigen::Map<const Eigen::Matrix<double, 3, 6>> WT(coupling_.data() + 18 * (point.first + k));
      g.segment<6>(offsets_[point.first + k]).noalias() -= WT.transpose() * v_inv_w;
    }
  }
}

void PointBlocks::back_substitute(const Eigen::VectorXd& step, std::vector<Eigen::Vector3d>& point_steps) const {
  point_steps.resize(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const PointBlock& point = points_[i];
    Eigen::Vector3d rhs = point.w;
    for (int k = 0; k < point.count; ++k) {
      const Eigen::Map<const Eigen::Matrix<double, 3, 6>> WT(coupling_.data() + 18 * (point.first + k));
      rhs.noalias() += WT * step.segment<6>(offsets_[point.first + k]);
    }
    point_steps[i].noalias() = -(point.V_inverse * rhs);
  }
}

}  // namespace fbvins
