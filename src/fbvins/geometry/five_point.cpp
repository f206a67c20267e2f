// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/five_point.hpp"

#include <Eigen/Dense>

namespace fbvins {
namespace {

// Polynomials in x, y, z of degree <= 3. Monomials in graded order: the ten of degree 3 first, so
// that eliminating them writes each in terms of the ten of lower degree.
struct Exponent {
  int x, y, z;
};
constexpr std::array<Exponent, 20> kMonomials = {{
    {3, 0, 0}, {2, 1, 0}, {2, 0, 1}, {1, 2, 0}, {1, 1, 1}, {1, 0, 2}, {0, 3, 0}, {0, 2, 1}, {0, 1, 2}, {0, 0, 3},
    {2, 0, 0}, {1, 1, 0}, {1, 0, 1}, {0, 2, 0}, {0, 1, 1}, {0, 0, 2}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0},
}};

constexpr int monomial_index(int x, int y, int z) {
  for (int i = 0; i < 20; ++i)
    if (kMonomials[i].x == x && kMonomials[i].y == y && kMonomials[i].z == z) return i;
  return -1;
}

constexpr std::array<std::array<int, 20>, 20> make_product_table() {
  std::array<std::array<int, 20>, 20> table{};
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j)
      table[i][j] =
          monomial_index(kMonomials[i].x + kMonomials[j].x, kMonomials[i].y + kMonomials[j].y, kMonomials[i].z + kMonomials[j].z);
  return table;
}
constexpr auto kProduct = make_product_table();

using Poly = Eigen::Matrix<double, 20, 1>;

/// Product of polynomials whose lowest monomial index with a coefficient is first_a / first_b
/// (16: linear, 10: quadratic).
Poly multiply(const Poly& a, int first_a, const Poly& b, int first_b) {
  Poly c = Poly::Zero();
  for (int i = first_a; i < 20; ++i)
    for (int j = first_b; j < 20; ++j) c[kProduct[i][j]] += a[i] * b[j];
  return c;
}

using PolyMatrix = std::array<std::array<Poly, 3>, 3>;

PolyMatrix linear_family(const Eigen::Matrix<double, 9, 4>& basis) {
  PolyMatrix E;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      E[r][c].setZero();
      E[r][c].tail<4>() = basis.row(3 * r + c).transpose();
    }
  return E;
}

/// Coefficients of the ten constraints on E, one a row.
Eigen::Matrix<double, 10, 20> constraints(const PolyMatrix& E) {
  constexpr int kLinear = 16, kQuadratic = 10;
  PolyMatrix EEt;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      EEt[r][c].setZero();
      for (int k = 0; k < 3; ++k) EEt[r][c] += multiply(E[r][k], kLinear, E[c][k], kLinear);
    }
  const Poly half_trace = 0.5 * (EEt[0][0] + EEt[1][1] + EEt[2][2]);
  for (int r = 0; r < 3; ++r) EEt[r][r] -= half_trace;

  Eigen::Matrix<double, 10, 20> rows;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      Poly sum = Poly::Zero();
      for (int k = 0; k < 3; ++k) sum += multiply(EEt[r][k], kQuadratic, E[k][c], kLinear);
      rows.row(3 * r + c) = sum.transpose();
    }
  Poly det = Poly::Zero();
  for (int c = 0; c < 3; ++c) {
    const int p = (c + 1) % 3, q = (c + 2) % 3;
    const Poly minor = multiply(E[1][p], kLinear, E[2][q], kLinear) - multiply(E[1][q], kLinear, E[2][p], kLinear);
    det += multiply(minor, kQuadratic, E[0][c], kLinear);
  }
  rows.row(9) = det.transpose();
  return rows;
}

Eigen::Matrix<double, 9, 4> null_space(std::span<const Vec2, 5> a, std::span<const Vec2, 5> b) {
  Eigen::Matrix<double, 9, 5> transposed;
  for (int i = 0; i < 5; ++i) {
    const Vec3 x = a[i].homogeneous(), y = b[i].homogeneous();
    for (int r = 0; r < 3; ++r) transposed.block<3, 1>(3 * r, i) = y[r] * x;
  }
  const Eigen::Matrix<double, 9, 9> Q =
      Eigen::HouseholderQR<Eigen::Matrix<double, 9, 5>>(transposed).householderQ() * Eigen::Matrix<double, 9, 9>::Identity();
  return Q.rightCols<4>();
}

}  // namespace

std::vector<Mat3> five_point(std::span<const Vec2, 5> a, std::span<const Vec2, 5> b) {
  const Eigen::Matrix<double, 9, 4> basis = null_space(a, b);
  const Eigen::Matrix<double, 10, 20> rows = constraints(linear_family(basis));
  const Eigen::FullPivLU<Eigen::Matrix<double, 10, 10>> lu(rows.leftCols<10>());
  if (lu.rcond() < 1e-14) return {};
  const Eigen::Matrix<double, 10, 10> reduced = lu.solve(rows.rightCols<10>());

  // Multiplication by x on (x2, xy, xz, y2, yz, z2, x, y, z, 1).
  Eigen::Matrix<double, 10, 10> action = Eigen::Matrix<double, 10, 10>::Zero();
  action.topRows<6>() = -reduced.topRows<6>();
  action(6, 0) = action(7, 1) = action(8, 2) = action(9, 6) = 1.0;
  const Eigen::EigenSolver<Eigen::Matrix<double, 10, 10>> eigen(action);

  std::vector<Mat3> solutions;
  for (int i = 0; i < 10; ++i) {
    if (std::abs(eigen.eigenvalues()[i].imag()) > 1e-9) continue;
    const Eigen::Matrix<double, 10, 1> v = eigen.eigenvectors().col(i).real();
    if (std::abs(v[9]) < 1e-12) continue;
    const Eigen::Vector4d weights(v[6] / v[9], v[7] / v[9], v[8] / v[9], 1.0);
    const Eigen::Matrix<double, 9, 1> e = (basis * weights).normalized();
    if (!e.allFinite()) continue;
    solutions.push_back(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(e.data()));
  }
  return solutions;
}

RotationTranslation decompose_essential(const Mat3& E) {
  const Eigen::JacobiSVD<Mat3> svd(E, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Mat3 U = svd.matrixU(), V = svd.matrixV();
  if (U.determinant() < 0) U.col(2) = -U.col(2);
  if (V.determinant() < 0) V.col(2) = -V.col(2);
  Mat3 quarter_turn;
  quarter_turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Mat3 R1 = U * quarter_turn * V.transpose();
  const Mat3 R2 = U * quarter_turn.transpose() * V.transpose();
  return {R1.trace() > R2.trace() ? R1 : R2, U.col(2)};
}

}  // namespace fbvins
