// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/adjustment_costs.hpp"

namespace fbvins {
namespace {

template <int Rows, int Columns>
using RowMajor = Eigen::Matrix<double, Rows, Columns, Eigen::RowMajor>;

/// No step leads nearer to a camera's plane than this, or behind it.
constexpr double kNearestPlane_m = 0.05;

NavState<M> state_of(const Quat& start, const double* pose, const double* motion) {
  NavState<M> s;
  s.T_FB = {orientation<6>(start, pose), Vec3(pose[0], pose[1], pose[2])};
  s.v_FB = {motion[0], motion[1], motion[2]};
  s.bias = {{motion[3], motion[4], motion[5]}, {motion[6], motion[7], motion[8]}};
  return s;
}

void fill(const Mat15& J, const double* pose, double* by_pose, double* by_motion) {
  if (by_pose != nullptr) {
    Eigen::Map<RowMajor<15, 6>> out(by_pose);
    out.leftCols<3>() = J.middleCols<3>(nav::p);
    out.rightCols<3>() = J.middleCols<3>(nav::theta) * turn_jacobian(pose);
  }
  if (by_motion != nullptr) Eigen::Map<RowMajor<15, 9>>(by_motion, 15, 9) = J.middleCols<9>(nav::v);
}

}  // namespace

Quat turn_of(const TiltBlock& tilt) { return so3_exp(Vec3(tilt[0], tilt[1], 0)); }

bool ObservationCost::Evaluate(double const* const* x, double* residual, double** jacobians) const {
  const Vec3 p_MB(x[0][0], x[0][1], x[0][2]), p_M(x[1][0], x[1][1], x[1][2]);
  const Mat3 R_BM = orientation<6>(q_MB_, x[0]).toRotationMatrix().transpose(), R_CB = T_BC0_.R().transpose();
  const Vec3 p_B = R_BM * (p_M - p_MB), p_C = R_CB * (p_B - T_BC0_.p);
  if (p_C.z() < kNearestPlane_m) return false;
  const double rho = 1 / p_C.z(), by_xy = 1 / static_cast<double>(seen_.sigma_xy);
  const double by_rho = seen_.has_depth() ? 1 / static_cast<double>(seen_.sigma_inverse_depth) : 0;
  residual[0] = (p_C.x() * rho - static_cast<double>(seen_.x)) * by_xy;
  residual[1] = (p_C.y() * rho - static_cast<double>(seen_.y)) * by_xy;
  residual[2] = (rho - static_cast<double>(seen_.inverse_depth)) * by_rho;
  if (jacobians == nullptr) return true;
  Mat3 J_C;
  J_C << rho * by_xy, 0, -p_C.x() * rho * rho * by_xy, 0, rho * by_xy, -p_C.y() * rho * rho * by_xy, 0, 0, -rho * rho * by_rho;
  const Mat3 J_B = J_C * R_CB, J_M = J_B * R_BM;
  if (jacobians[0] != nullptr) {
    Eigen::Map<RowMajor<3, 6>> out(jacobians[0]);
    out.leftCols<3>() = -J_M;
    out.rightCols<3>() = J_B * hat(p_B) * turn_jacobian(x[0]);
  }
  if (jacobians[1] != nullptr) Eigen::Map<RowMajor<3, 3>>(jacobians[1], 3, 3) = J_M;
  return true;
}

std::optional<Vec3> ObservationCost::residual(const PoseBlock& pose, const PointBlock& point) const {
  const double* x[] = {pose.data(), point.data()};
  Vec3 r;
  return Evaluate(x, r.data(), nullptr) ? std::optional(r) : std::nullopt;
}

bool ImuCost::Evaluate(double const* const* x, double* residual, double** jacobians) const {
  const NavState<M> i = state_of(q_Mi_, x[0], x[1]), j = state_of(q_Mj_, x[2], x[3]);
  const Vec3 turn(x[4][0], x[4][1], 0), gravity = -gravity_mps2_ * (so3_exp(turn) * Vec3::UnitZ());
  Mat15 J_i, J_j;
  const bool wanted = jacobians != nullptr;
  Eigen::Map<Vec15>(residual, 15) =
      weighted_imu_residual(i, j, *between_, gravity, wanted ? &J_i : nullptr, wanted ? &J_j : nullptr);
  if (!wanted) return true;
  fill(J_i, x[0], jacobians[0], jacobians[1]);
  fill(J_j, x[2], jacobians[2], jacobians[3]);
  if (jacobians[4] != nullptr) {
    const Mat3 J_gravity = -hat(gravity) * so3_right_jacobian(-turn);
    const double dt = between_->dt_s();
    Eigen::Matrix<double, 15, 2> J = Eigen::Matrix<double, 15, 2>::Zero();
    J.middleRows<3>(nav::p) = -0.5 * dt * dt * i.T_FB.R().transpose() * J_gravity.leftCols<2>();
    J.middleRows<3>(nav::v) = -dt * i.T_FB.R().transpose() * J_gravity.leftCols<2>();
    Eigen::Map<RowMajor<15, 2>>(jacobians[4], 15, 2) = between_->sqrt_information() * J;
  }
  return true;
}

}  // namespace fbvins
