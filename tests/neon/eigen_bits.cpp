// SPDX-License-Identifier: Apache-2.0
// Prints a hash of results of Eigen and the mathematical library: machines print the same number if they round alike.
#include <Eigen/Dense>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "fbvins/core/hypotenuse.hpp"

namespace {

/// FNV-1a hash of the bits of the added numbers.
class Sum {
 public:
  template <class Scalar>
  void add(const Scalar* values, Eigen::Index count) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(values);
    for (Eigen::Index i = 0; i < count * static_cast<Eigen::Index>(sizeof(Scalar)); ++i)
      value_ = (value_ ^ bytes[i]) * 1099511628211ULL;
  }
  template <class Derived>
  void add(const Eigen::PlainObjectBase<Derived>& m) {
    add(m.data(), m.size());
  }
  void add(double value) { add(&value, 1); }
  void print(const char* name) const { std::printf("%s %016llx\n", name, static_cast<unsigned long long>(value_)); }

 private:
  std::uint64_t value_ = 14695981039346656037ULL;
};

/// Pseudo-random numbers from -0.5 to 0.5, the same on every machine.
class Numbers {
 public:
  double next() {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state_ >> 33) / 2147483648.0 - 0.5;
  }
  template <class Matrix>
  void fill(Matrix& m) {
    for (Eigen::Index i = 0; i < m.size(); ++i) m.data()[i] = static_cast<typename Matrix::Scalar>(next());
  }

 private:
  std::uint64_t state_ = 20;
};

/// Sizes below and above those at which Eigen changes its algorithm, up to the size of a window.
void large() {
  using Matrix = Eigen::MatrixXd;
  using Vector = Eigen::VectorXd;
  Numbers numbers;
  Sum sum;
  for (int n : {1, 2, 3, 5, 7, 8, 11, 15, 16, 23, 30, 47, 48, 61, 97, 150, 301}) {
    Matrix A(n, n + 3), B(n + 3, n + 1);
    numbers.fill(A), numbers.fill(B);
    const Matrix C = A * B;
    const Matrix H = A * A.transpose() + Matrix::Identity(n, n);
    const Vector b = C.col(0), x = H.ldlt().solve(b), y = H.llt().solve(b), Hx = H * x, Atx = A.transpose() * x;
    const Matrix inverse = H.llt().solve(Matrix::Identity(n, n));
    for (const Matrix& m : {C, H, inverse}) sum.add(m);
    for (const Vector& v : {x, y, Hx, Atx}) sum.add(v);
    sum.add(b.dot(x)), sum.add(C.norm()), sum.add(C.sum());
  }
  sum.print("large");
}

template <class Scalar, int N>
void fixed(const char* name) {
  using Matrix = Eigen::Matrix<Scalar, N, N>;
  Numbers numbers;
  Sum sum;
  for (int i = 0; i < 300; ++i) {
    Matrix A, B;
    numbers.fill(A), numbers.fill(B);
    const Matrix C = A * B.transpose() * A, D = C + Scalar(2) * A;
    const Eigen::Matrix<Scalar, N, 1> v = C * A.col(0), u = v.normalized();
    sum.add(C), sum.add(D), sum.add(v), sum.add(u);
    sum.add(static_cast<double>(C.trace())), sum.add(static_cast<double>(C.squaredNorm()));
  }
  sum.print(name);
}

void rotations() {
  Numbers numbers;
  Sum sum;
  for (int i = 0; i < 300; ++i) {
    Eigen::Vector4d a, b;
    numbers.fill(a), numbers.fill(b);
    const Eigen::Quaterniond q(a.normalized()), p(b.normalized()), r = q * p * q.conjugate();
    sum.add(r.coeffs());
    const Eigen::Matrix3d R = r.toRotationMatrix(), S = R.inverse();
    const Eigen::Vector3d turned = q * a.head<3>();
    sum.add(R), sum.add(S), sum.add(turned), sum.add(Eigen::Quaterniond(R).coeffs());
  }
  sum.print("rotations");
}

/// The functions that the odometry calls.
void functions() {
  Numbers numbers;
  Sum sum;
  for (int i = 0; i < 100000; ++i) {
    const double x = numbers.next(), y = numbers.next(), angle = 6.3 * x;
    for (double value :
         {std::sin(angle), std::cos(angle), std::tan(x), std::acos(2 * x), std::asin(2 * x), std::atan(9 * x), std::atan2(x, y),
          std::atanh(x), std::exp(9 * x), std::log(std::abs(x) + 1e-9), std::log1p(x), std::pow(std::abs(x), y), std::cosh(x),
          std::remainder(30 * x, 6.283185307179586), std::sqrt(std::abs(x))})
      sum.add(value);
    for (float value : {std::sin(static_cast<float>(angle)), std::cos(static_cast<float>(angle)),
                        std::hypot(static_cast<float>(x), static_cast<float>(y)), std::log2(static_cast<float>(x * x) + 1e-9f)})
      sum.add(static_cast<double>(value));
  }
  sum.print("functions");
}

void hypotenuses() {
  Numbers numbers;
  Sum sum;
  for (int i = 0; i < 100000; ++i) {
    const double x = numbers.next(), y = numbers.next();
    sum.add(fbvins::hypotenuse(x, y)), sum.add(fbvins::hypotenuse(1, x * y));
  }
  sum.print("hypotenuses");
}

}  // namespace

int main() {
  // Eigen splits products of more than a hundred columns by the size of the caches, and the rounding depends on the split.
  Eigen::setCpuCacheSizes(32 * 1024, 256 * 1024, 2 * 1024 * 1024);
  large();
  fixed<double, 2>("double_2");
  fixed<double, 3>("double_3");
  fixed<double, 6>("double_6");
  fixed<double, 15>("double_15");
  fixed<float, 3>("float_3");
  rotations();
  functions();
  hypotenuses();
}
