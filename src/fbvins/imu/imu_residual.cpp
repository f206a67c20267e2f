// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/imu_residual.hpp"

namespace fbvins {
namespace {

/// The 3x3 blocks of both Jacobians that are neither zero nor the identity (eq. P21-P24).
struct Blocks {
  Mat3 R_i_t;                         ///< d r_p / d p_j = d r_v / d v_j; negative for i
  Mat3 p_theta, v_theta;              ///< by the rotation of i
  Mat3 theta_theta_i, theta_theta_j;  ///< by the rotations
  Mat3 theta_bg;                      ///< by the gyro bias of i
  double dt_s;
};

struct Motion {
  Vec3 p, v;  ///< displacement and change of velocity less gravity, in B_i
};

template <class F>
Motion motion(const NavState<F>& i, const NavState<F>& j, double dt, const Vec3& gravity_F) {
  const Quat q_i_t = i.T_FB.q.conjugate();
  return {q_i_t * Vec3(j.T_FB.p - i.T_FB.p - dt * i.v_FB - 0.5 * dt * dt * gravity_F),
          q_i_t * Vec3(j.v_FB - i.v_FB - dt * gravity_F)};
}

template <class F>
Blocks blocks(const NavState<F>& i, const NavState<F>& j, const Preintegration& between, const Vec3& gravity_F) {
  const double dt = between.dt_s();
  const Motion m = motion(i, j, dt, gravity_F);
  const Vec3 dbg = i.bias.gyro_radps - between.linearisation_bias().gyro_radps;
  const Vec3 correction = between.J_theta_bg() * dbg;
  const Quat q_ij = i.T_FB.q.conjugate() * j.T_FB.q;
  const Quat q_r = (between.delta_q() * so3_exp(correction)).conjugate() * q_ij;
  Blocks b;
  b.dt_s = dt;
  b.R_i_t = i.T_FB.R().transpose();
  b.p_theta = hat(m.p);
  b.v_theta = hat(m.v);
  b.theta_theta_j = so3_right_jacobian_inverse(so3_log(q_r));
  b.theta_theta_i = -b.theta_theta_j * q_ij.toRotationMatrix().transpose();
  b.theta_bg = -b.theta_theta_j * q_r.toRotationMatrix().transpose() * so3_right_jacobian(correction) * between.J_theta_bg();
  return b;
}

/// U * J without forming J: U has 15 rows, the blocks are 3x3.
void weighted(const Blocks& b, const Preintegration& between, const Mat15& U, Mat15* J_i, Mat15* J_j) {
  using Columns = Eigen::Matrix<double, 15, 3>;
  const auto U_p = U.middleCols<3>(nav::p), U_theta = U.middleCols<3>(nav::theta), U_v = U.middleCols<3>(nav::v);
  const auto U_bg = U.middleCols<3>(nav::bg), U_ba = U.middleCols<3>(nav::ba);
  const Columns p_R = U_p * b.R_i_t, v_R = U_v * b.R_i_t;
  if (J_i != nullptr) {
    J_i->middleCols<3>(nav::p) = -p_R;
    J_i->middleCols<3>(nav::theta) = U_p * b.p_theta + U_theta * b.theta_theta_i + U_v * b.v_theta;
    J_i->middleCols<3>(nav::v) = -b.dt_s * p_R - v_R;
    J_i->middleCols<3>(nav::bg) = U_theta * b.theta_bg - U_p * between.J_p_bg() - U_v * between.J_v_bg() - U_bg;
    J_i->middleCols<3>(nav::ba) = -(U_p * between.J_p_ba()) - U_v * between.J_v_ba() - U_ba;
  }
  if (J_j != nullptr) {
    J_j->middleCols<3>(nav::p) = p_R;
    J_j->middleCols<3>(nav::theta) = U_theta * b.theta_theta_j;
    J_j->middleCols<3>(nav::v) = v_R;
    J_j->middleCols<3>(nav::bg) = U_bg;
    J_j->middleCols<3>(nav::ba) = U_ba;
  }
}

}  // namespace

template <class F>
Vec15 imu_residual(const NavState<F>& i, const NavState<F>& j, const Preintegration& between, const Vec3& gravity_F) {
  const ImuDeltas d = between.corrected(i.bias);
  const Motion m = motion(i, j, between.dt_s(), gravity_F);
  Vec15 r;  // eq. P17-P20
  r.segment<3>(nav::p) = m.p - d.p;
  r.segment<3>(nav::theta) = so3_log(d.q.conjugate() * (i.T_FB.q.conjugate() * j.T_FB.q));
  r.segment<3>(nav::v) = m.v - d.v;
  r.segment<3>(nav::bg) = j.bias.gyro_radps - i.bias.gyro_radps;
  r.segment<3>(nav::ba) = j.bias.accel_mps2 - i.bias.accel_mps2;
  return r;
}

template <class F>
void imu_jacobians(const NavState<F>& i, const NavState<F>& j, const Preintegration& between, const Vec3& gravity_F, Mat15& J_i,
                   Mat15& J_j) {
  const Blocks b = blocks(i, j, between, gravity_F);
  J_i.setZero();
  J_i.block<3, 3>(nav::p, nav::p) = -b.R_i_t;
  J_i.block<3, 3>(nav::p, nav::theta) = b.p_theta;
  J_i.block<3, 3>(nav::p, nav::v) = -b.dt_s * b.R_i_t;
  J_i.block<3, 3>(nav::p, nav::bg) = -between.J_p_bg();
  J_i.block<3, 3>(nav::p, nav::ba) = -between.J_p_ba();
  J_i.block<3, 3>(nav::theta, nav::theta) = b.theta_theta_i;
  J_i.block<3, 3>(nav::theta, nav::bg) = b.theta_bg;
  J_i.block<3, 3>(nav::v, nav::theta) = b.v_theta;
  J_i.block<3, 3>(nav::v, nav::v) = -b.R_i_t;
  J_i.block<3, 3>(nav::v, nav::bg) = -between.J_v_bg();
  J_i.block<3, 3>(nav::v, nav::ba) = -between.J_v_ba();
  J_i.diagonal().tail<6>().setConstant(-1);
  J_j.setZero();
  J_j.block<3, 3>(nav::p, nav::p) = b.R_i_t;
  J_j.block<3, 3>(nav::theta, nav::theta) = b.theta_theta_j;
  J_j.block<3, 3>(nav::v, nav::v) = b.R_i_t;
  J_j.diagonal().tail<6>().setConstant(1);
}

template <class F>
Vec15 imu_residual(const NavState<F>& i, const NavState<F>& j, const NavState<F>& i_lin, const NavState<F>& j_lin,
                   const Preintegration& between, const Vec3& gravity_F, Mat15* J_i, Mat15* J_j) {
  if (J_i != nullptr || J_j != nullptr) {
    Mat15 unused_i, unused_j;
    imu_jacobians(i_lin, j_lin, between, gravity_F, J_i != nullptr ? *J_i : unused_i, J_j != nullptr ? *J_j : unused_j);
  }
  return imu_residual(i, j, between, gravity_F);
}

template <class F>
Vec15 weighted_imu_residual(const NavState<F>& i, const NavState<F>& j, const NavState<F>& i_lin, const NavState<F>& j_lin,
                            const Preintegration& between, const Vec3& gravity_F, Mat15* J_i, Mat15* J_j) {
  const Mat15& U = between.sqrt_information();
  if (J_i != nullptr || J_j != nullptr) weighted(blocks(i_lin, j_lin, between, gravity_F), between, U, J_i, J_j);
  return U.triangularView<Eigen::Upper>() * imu_residual(i, j, between, gravity_F);
}

#define FBVINS_IN_FRAME(F)                                                                                                 \
  template Vec15 imu_residual(const NavState<F>&, const NavState<F>&, const Preintegration&, const Vec3&);                 \
  template void imu_jacobians(const NavState<F>&, const NavState<F>&, const Preintegration&, const Vec3&, Mat15&, Mat15&); \
  template Vec15 imu_residual(const NavState<F>&, const NavState<F>&, const NavState<F>&, const NavState<F>&,              \
                              const Preintegration&, const Vec3&, Mat15*, Mat15*);                                         \
  template Vec15 weighted_imu_residual(const NavState<F>&, const NavState<F>&, const NavState<F>&, const NavState<F>&,     \
                                       const Preintegration&, const Vec3&, Mat15*, Mat15*);
FBVINS_IN_FRAME(G)
FBVINS_IN_FRAME(W)
FBVINS_IN_FRAME(M)
#undef FBVINS_IN_FRAME

}  // namespace fbvins
