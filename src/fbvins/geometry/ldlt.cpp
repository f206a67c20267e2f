// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/ldlt.hpp"

#include <Eigen/LU>

namespace fbvins {

template <int N>
Ldlt<N>::Ldlt(const Matrix& A) : factor_(A) {}

template <int N>
bool Ldlt<N>::succeeded() const {
  return factor_.info() == Eigen::Success;
}

template <int N>
double Ldlt<N>::least_pivot() const {
  return factor_.vectorD().minCoeff();
}

template <int N>
template <class Right>
Right Ldlt<N>::solve(const Right& b) const {
  return factor_.solve(b);
}

Mat6 inverted(const Mat6& A) { return A.inverse(); }

Mat6 upper_cholesky(const Mat6& A) { return Eigen::LLT<Mat6>(A).matrixU(); }
bool is_positive_definite(const Mat6& A) { return Eigen::LLT<Mat6>(A).info() == Eigen::Success; }

using RowsOf6x4 = Eigen::Matrix<double, 6, 4, Eigen::RowMajor>;

template class Ldlt<3>;
template class Ldlt<4>;
template class Ldlt<5>;
template class Ldlt<6>;
template class Ldlt<8>;
template class Ldlt<9>;
template Vec3 Ldlt<3>::solve(const Vec3&) const;
template Mat3 Ldlt<3>::solve(const Mat3&) const;
template Eigen::Matrix<double, 3, 9> Ldlt<3>::solve(const Eigen::Matrix<double, 3, 9>&) const;
template Eigen::Vector4d Ldlt<4>::solve(const Eigen::Vector4d&) const;
template Eigen::Matrix4d Ldlt<4>::solve(const Eigen::Matrix4d&) const;
template Eigen::Matrix<double, 5, 1> Ldlt<5>::solve(const Eigen::Matrix<double, 5, 1>&) const;
template Vec6 Ldlt<6>::solve(const Vec6&) const;
template Mat6 Ldlt<6>::solve(const Mat6&) const;
template Eigen::Matrix<double, 6, 4> Ldlt<6>::solve(const Eigen::Matrix<double, 6, 4>&) const;
template RowsOf6x4 Ldlt<6>::solve(const RowsOf6x4&) const;
template Eigen::Matrix<double, 8, 1> Ldlt<8>::solve(const Eigen::Matrix<double, 8, 1>&) const;
template Eigen::Matrix<double, 8, 8> Ldlt<8>::solve(const Eigen::Matrix<double, 8, 8>&) const;
template Eigen::Matrix<double, 9, 1> Ldlt<9>::solve(const Eigen::Matrix<double, 9, 1>&) const;

}  // namespace fbvins
