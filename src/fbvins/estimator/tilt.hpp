// SPDX-License-Identifier: Apache-2.0
// The direction of gravity in the window's frame (docs/derivations/window.md, W13-W16).
//
// W is level when a flight begins, as far as the tilt is known then. The window never turns it, so that remembered landmarks
// stay valid. What is learned of gravity later changes the tilt instead, a state of the window; published poses are
// levelled, about the place where the flight began, in small steps (published_pose.hpp). A value.
//
//   out.T_WB = window.tilt().levelled(state.T_WB);
#pragma once

#include "fbvins/imu/nav_state.hpp"

namespace fbvins {

using Mat32 = Eigen::Matrix<double, 3, 2>;
using Mat17 = Eigen::Matrix<double, 17, 17>;
using Mat15x17 = Eigen::Matrix<double, 15, 17>;

struct Tilt {
  Vec2 angle_rad = Vec2::Zero();  ///< the rotation vector (x, y, 0) takes z to up
  Vec3 pivot_W = Vec3::Zero();    ///< m; levelling does not move this point

  /// Takes directions in the levelled frame to W (W13).
  Quat q() const { return so3_exp(rotation()); }
  Vec3 gravity_W(double gravity_mps2) const { return -gravity_mps2 * (q() * Vec3::UnitZ()); }

  /// d gravity_W / d angle (W14).
  Mat32 gravity_jacobian(double gravity_mps2) const {
    return -hat(gravity_W(gravity_mps2)) * so3_right_jacobian(-rotation()).leftCols<2>();
  }

  Vec3 levelled(const Vec3& p_W) const { return pivot_W + q().conjugate() * (p_W - pivot_W); }
  Pose<W, B> levelled(const Pose<W, B>& T_WB) const { return {(q().conjugate() * T_WB.q).normalized(), levelled(T_WB.p)}; }
  NavState levelled(const NavState& s) const { return {levelled(s.T_WB), q().conjugate() * s.v_WB, s.bias}; }

  /// d levelled state / d (p, theta, v, bg, ba, angle) (W16).
  Mat15x17 levelled_jacobian(const NavState& s) const {
    const Mat3 R = q().conjugate().toRotationMatrix();
    const NavState level = levelled(s);
    const Mat32 turn = -so3_right_jacobian(rotation()).leftCols<2>();  // dphi by the angle (W16)
    Mat15x17 J = Mat15x17::Zero();
    J.leftCols<15>().setIdentity();
    J.block<3, 3>(nav::p, nav::p) = J.block<3, 3>(nav::v, nav::v) = R;
    J.block<3, 2>(nav::p, 15) = -hat(level.T_WB.p - pivot_W) * turn;
    J.block<3, 2>(nav::theta, 15) = level.T_WB.R().transpose() * turn;
    J.block<3, 2>(nav::v, 15) = -hat(level.v_WB) * turn;
    return J;
  }
  /// From the covariance of (p, theta, v, bg, ba, angle) in the window.
  Mat15 levelled_covariance(const NavState& s, const Mat17& covariance) const {
    const Mat15x17 J = levelled_jacobian(s);
    return J * covariance * J.transpose();
  }

 private:
  Vec3 rotation() const { return {angle_rad.x(), angle_rad.y(), 0}; }
};

}  // namespace fbvins
