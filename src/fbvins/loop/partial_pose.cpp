// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/partial_pose.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

#include "fbvins/geometry/ldlt.hpp"

namespace fbvins {
namespace {

/// Eigenvalues below this share of the largest are rounding errors of zero.
constexpr double kZeroShare = 1e-13;
/// No tag's pose is more certain than this: its size, its place and the lens are not.
constexpr double kTagFloor_m = 0.003, kTagFloor_rad = 0.003;

template <class Mat>
double largest(const Mat& covariance) {
  return Eigen::SelfAdjointEigenSolver<Mat>(covariance, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

PartialPose measurement(const PositionAnchor& a) {
  PartialPose out{a.p_B, {Quat::Identity(), a.p_A}};
  out.information.topLeftCorner<3, 3>() = a.covariance.inverse();
  return out;
}

PartialPose measurement(const HeightAnchor& a) {
  PartialPose out{a.p_B, {Quat::Identity(), Vec3(0, 0, a.z_A_m)}};
  out.information(2, 2) = 1 / (a.sigma_m * a.sigma_m);
  return out;
}

/// T_AB = T_AT T_BT^-1: dp_A = -R_AB (dp_B + hat(dtheta_B) p_BT), and dtheta_T of the tag turns the body by -R_BT dtheta_T.
PartialPose measurement(const TagAnchor& a) {
  PartialPose out{Vec3::Zero(), a.T_AT * a.T_BT.inverse()};
  const Mat3 R_AB = out.T_AB.R(), R_BT = a.T_BT.R();
  Mat6 J = Mat6::Zero();
  J.topLeftCorner<3, 3>() = -R_AB;
  J.topRightCorner<3, 3>() = -R_AB * hat(a.T_BT.p) * R_BT;
  J.bottomRightCorner<3, 3>() = -R_BT;
  Mat6 cov = J * a.covariance * J.transpose();
  cov.diagonal().head<3>().array() += kTagFloor_m * kTagFloor_m;
  cov.diagonal().tail<3>().array() += kTagFloor_rad * kTagFloor_rad;
  const Mat6 information = inverted(cov);
  out.information = 0.5 * (information + information.transpose());
  return out;
}

}  // namespace

Vec6 residual(const PartialPose& measured, const Quat& q_AB, const Vec3& p_AB) {
  Vec6 r;
  const Quat e = measured.T_AB.q.conjugate() * q_AB;
  r << q_AB * measured.p_B + p_AB - measured.T_AB.p, (e.w() < 0 ? -2.0 : 2.0) * e.vec();
  return r;
}

bool is_information(const Mat6& information) {
  const Vec6 eigenvalues = Eigen::SelfAdjointEigenSolver<Mat6>(information, Eigen::EigenvaluesOnly).eigenvalues();
  return eigenvalues.minCoeff() >= -1e-9 * std::abs(eigenvalues.maxCoeff());
}

Mat6 root_of(const Mat6& information) {
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(information);
  const double least = kZeroShare * eigen.eigenvalues().maxCoeff();
  const Vec6 roots = eigen.eigenvalues().unaryExpr([&](double l) { return l > least ? std::sqrt(l) : 0.0; });
  return roots.asDiagonal() * eigen.eigenvectors().transpose();
}

Mat6 widened(const Mat6& information, const Mat6& L) {
  const Mat6 S = root_of(information);
  const Mat6 W = S * L;
  const Mat6 inner = Mat6::Identity() + W * W.transpose();
  const Mat6 out = S.transpose() * Ldlt<6>(inner).solve(S);
  return 0.5 * (out + out.transpose());
}

Mat6 tilt_error(const PartialPose& measured, const Quat& q_AB, const Vec3& up_B, double sigma_rad) {
  const Mat3 tilt = sigma_rad * (Mat3::Identity() - up_B * up_B.transpose());
  Mat6 L = Mat6::Zero();
  L.topRightCorner<3, 3>() = -q_AB.toRotationMatrix() * hat(measured.p_B) * tilt;
  L.bottomRightCorner<3, 3>() = tilt;
  return L;
}

PartialPose carried(const PartialPose& measured, const Pose<B, B>& T_other_this, const Mat6& covariance) {
  const Mat3 R = T_other_this.R();
  Mat6 turn = Mat6::Identity();  // dtheta in this body from dtheta in the other
  turn.bottomRightCorner<3, 3>() = R.transpose();
  Eigen::Matrix<double, 3, 6> J_point;  // of the measured point in the other body
  J_point << Mat3::Identity(), -R * hat(measured.p_B);
  const double point_m2 = largest(Mat3(J_point * covariance * J_point.transpose()));
  const double turn_rad2 = largest(Mat3(covariance.bottomRightCorner<3, 3>()));
  Vec6 sigma;
  sigma << Vec3::Constant(std::sqrt(std::max(0.0, point_m2))), Vec3::Constant(std::sqrt(std::max(0.0, turn_rad2)));
  PartialPose out{T_other_this * measured.p_B, {(measured.T_AB.q * T_other_this.q.conjugate()).normalized(), measured.T_AB.p}};
  out.information = widened(turn.transpose() * measured.information * turn, sigma.asDiagonal());
  return out;
}

PartialPose about_here(const Pose<M, B>& T_MB) {
  constexpr double kLoose_m = 1, kLoose_rad = 0.2;
  PartialPose out{Vec3::Zero(), T_MB.cast_frames<A, B>()};
  out.information.diagonal() << Vec3::Constant(1 / (kLoose_m * kLoose_m)), Vec3::Constant(1 / (kLoose_rad * kLoose_rad));
  return out;
}

PartialPose measurement_of(const Anchor& anchor) {
  return std::visit([](const auto& a) { return measurement(a); }, anchor);
}

}  // namespace fbvins
