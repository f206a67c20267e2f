// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/five_point.hpp"

#include <Eigen/QR>
#include <cmath>
#include <utility>

#include "fbvins/geometry/real_roots.hpp"
#include "fbvins/geometry/svd3.hpp"

namespace fbvins {
namespace {

// Polynomials in x, y, z of degree <= 3. Monomials in graded order: the ten of degree 3 first.
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

constexpr int kPolishSteps = 2;

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

// Nister's order of elimination: x^2 z, x^2, y^2 z, y^2, xyz, xy are the last of the ten eliminated monomials; the ten that
// remain are (z^2, z, 1) x, (z^2, z, 1) y and (z^3, z^2, z, 1).
constexpr std::array<int, 20> kElimination = {0, 6, 1, 3, 2, 10, 7, 13, 4, 11, /**/ 5, 12, 16, 8, 14, 17, 9, 15, 18, 19};
using Constraints = std::array<std::array<double, 20>, 10>;

std::array<double, 20> in_order_of_elimination(const Poly& p) {
  std::array<double, 20> out;
  for (int i = 0; i < 20; ++i) out[i] = p[kElimination[i]];
  return out;
}

/// Coefficients of the ten constraints on E, one a row.
Constraints constraints(const PolyMatrix& E) {
  constexpr int kLinear = 16, kQuadratic = 10;
  PolyMatrix EEt;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      EEt[r][c].setZero();
      for (int k = 0; k < 3; ++k) EEt[r][c] += multiply(E[r][k], kLinear, E[c][k], kLinear);
    }
  const Poly half_trace = 0.5 * (EEt[0][0] + EEt[1][1] + EEt[2][2]);
  for (int r = 0; r < 3; ++r) EEt[r][r] -= half_trace;

  Constraints rows;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      Poly sum = Poly::Zero();
      for (int k = 0; k < 3; ++k) sum += multiply(EEt[r][k], kQuadratic, E[k][c], kLinear);
      rows[3 * r + c] = in_order_of_elimination(sum);
    }
  Poly det = Poly::Zero();
  for (int c = 0; c < 3; ++c) {
    const int p = (c + 1) % 3, q = (c + 2) % 3;
    const Poly minor = multiply(E[1][p], kLinear, E[2][q], kLinear) - multiply(E[1][q], kLinear, E[2][p], kLinear);
    det += multiply(minor, kQuadratic, E[0][c], kLinear);
  }
  rows[9] = in_order_of_elimination(det);
  return rows;
}

/// Gauss-Jordan elimination of the first ten columns, with the largest pivot of each. False where they are degenerate.
bool eliminate(Constraints& rows) {
  constexpr double kSmallestPivot = 1e-13;  // entries are products of components of unit vectors
  for (int k = 0; k < 10; ++k) {
    int pivot = k;
    for (int r = k + 1; r < 10; ++r)
      if (std::abs(rows[r][k]) > std::abs(rows[pivot][k])) pivot = r;
    std::swap(rows[k], rows[pivot]);
    if (!(std::abs(rows[k][k]) > kSmallestPivot)) return false;
    const double inverse = 1 / rows[k][k];
    for (int c = k; c < 20; ++c) rows[k][c] *= inverse;
    for (int r = 0; r < 10; ++r) {
      if (r == k) continue;
      const double factor = rows[r][k];
      for (int c = k; c < 20; ++c) rows[r][c] -= factor * rows[k][c];
    }
  }
  return true;
}

/// A polynomial in z, lowest first.
template <int Degree>
using InZ = std::array<double, Degree + 1>;

template <std::size_t N, std::size_t M>
std::array<double, N + M - 1> operator*(const std::array<double, N>& a, const std::array<double, M>& b) {
  std::array<double, N + M - 1> c{};
  for (std::size_t i = 0; i < N; ++i)
    for (std::size_t j = 0; j < M; ++j) c[i + j] += a[i] * b[j];
  return c;
}

template <std::size_t N>
std::array<double, N> operator-(std::array<double, N> a, const std::array<double, N>& b) {
  for (std::size_t i = 0; i < N; ++i) a[i] -= b[i];
  return a;
}

template <std::size_t N>
double at(const std::array<double, N>& p, double z) {
  double value = 0;
  for (std::size_t i = N; i-- > 0;) value = value * z + p[i];
  return value;
}

/// The line x(z) x + y(z) y + one(z) = 0 in the (x, y) plane.
struct LineInZ {
  InZ<3> x, y;
  InZ<4> one;
};

/// The row whose leading monomial is z m, minus z times the row whose leading monomial is m: the leading terms cancel.
LineInZ line(const std::array<double, 20>& with_z, const std::array<double, 20>& without) {
  LineInZ out{};
  for (int power = 0; power < 3; ++power) {
    out.x[power] += with_z[12 - power], out.x[power + 1] -= without[12 - power];
    out.y[power] += with_z[15 - power], out.y[power + 1] -= without[15 - power];
  }
  for (int power = 0; power < 4; ++power) out.one[power] += with_z[19 - power], out.one[power + 1] -= without[19 - power];
  return out;
}

/// Determinant of three lines; zero where they meet in one point.
InZ<10> determinant(const std::array<LineInZ, 3>& l) {
  const auto minor = [](const LineInZ& p, const LineInZ& q) { return p.x * q.y - q.x * p.y; };
  InZ<10> sum{};
  for (int i = 0; i < 3; ++i) {
    const InZ<10> term = minor(l[(i + 1) % 3], l[(i + 2) % 3]) * l[i].one;
    for (int k = 0; k <= 10; ++k) sum[k] += term[k];
  }
  return sum;
}

/// The point (x, y, 1), up to scale, in which the lines meet at z.
Vec3 meeting_point(const std::array<LineInZ, 3>& l, double z) {
  std::array<Vec3, 3> row;
  for (int i = 0; i < 3; ++i) row[i] = Vec3(at(l[i].x, z), at(l[i].y, z), at(l[i].one, z)).normalized();
  Vec3 best = Vec3::Zero();
  for (int i = 0; i < 3; ++i)
    if (const Vec3 v = row[i].cross(row[(i + 1) % 3]); v.squaredNorm() > best.squaredNorm()) best = v;
  return best;
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

/// One Gauss-Newton step of (x, y, z) on the ten constraints, to recover the digits lost in the elimination.
void polish(const Constraints& rows, Vec3& xyz) {
  std::array<double, 20> value{};
  std::array<Vec3, 20> slope;
  const auto power = [](double base, int n) { return n == 0 ? 1.0 : n == 1 ? base : n == 2 ? base * base : base * base * base; };
  for (int i = 0; i < 20; ++i) {
    const Exponent& e = kMonomials[kElimination[i]];
    const double px = power(xyz.x(), e.x), py = power(xyz.y(), e.y), pz = power(xyz.z(), e.z);
    value[i] = px * py * pz;
    slope[i] = {e.x == 0 ? 0 : e.x * power(xyz.x(), e.x - 1) * py * pz, e.y == 0 ? 0 : e.y * power(xyz.y(), e.y - 1) * px * pz,
                e.z == 0 ? 0 : e.z * power(xyz.z(), e.z - 1) * px * py};
  }
  Mat3 H = Mat3::Zero();
  Vec3 g = Vec3::Zero();
  for (const auto& row : rows) {
    double r = 0;
    Vec3 J = Vec3::Zero();
    for (int i = 0; i < 20; ++i) r += row[i] * value[i], J += row[i] * slope[i];
    H += J * J.transpose();
    g += r * J;
  }
  if (const Vec3 next = xyz - H.inverse() * g; next.allFinite()) xyz = next;
}

}  // namespace

std::vector<Mat3> five_point(std::span<const Vec2, 5> a, std::span<const Vec2, 5> b) {
  const Eigen::Matrix<double, 9, 4> basis = null_space(a, b);
  const Constraints equations = constraints(linear_family(basis));
  Constraints rows = equations;
  if (!eliminate(rows)) return {};
  const std::array<LineInZ, 3> lines{line(rows[4], rows[5]), line(rows[6], rows[7]), line(rows[8], rows[9])};
  const InZ<10> polynomial = determinant(lines);

  std::vector<Mat3> solutions;
  for (const double z : real_roots(polynomial)) {
    const Vec3 xy1 = meeting_point(lines, z);
    if (!(std::abs(xy1.z()) > 1e-12)) continue;
    Vec3 xyz(xy1.x() / xy1.z(), xy1.y() / xy1.z(), z);
    for (int step = 0; step < kPolishSteps; ++step) polish(equations, xyz);
    const Eigen::Matrix<double, 9, 1> e = (basis * xyz.homogeneous()).normalized();
    if (!e.allFinite()) continue;
    solutions.push_back(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(e.data()));
  }
  return solutions;
}

RotationTranslation decompose_essential(const Mat3& E) {
  auto [U, V, values] = svd3(E);
  if (U.determinant() < 0) U.col(2) = -U.col(2);
  if (V.determinant() < 0) V.col(2) = -V.col(2);
  Mat3 quarter_turn;
  quarter_turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Mat3 R1 = U * quarter_turn * V.transpose();
  const Mat3 R2 = U * quarter_turn.transpose() * V.transpose();
  return {R1.trace() > R2.trace() ? R1 : R2, U.col(2)};
}

}  // namespace fbvins
