// SPDX-License-Identifier: Apache-2.0
// The direction of gravity in the window's frame G (docs/derivations/window.md, W13-W16).
//
// G is level when a flight begins, as far as the tilt is known then. The window never turns it, so that remembered landmarks
// stay valid. What is learned of gravity later changes the tilt instead, a state of the window; published poses are
// levelled, about the position of the first pose, in small steps (published_pose.hpp). Only this takes G to W. A value.
//
//   NavState<W> level = window.tilt().levelled(window.newest().state);
#pragma once

#include "fbvins/imu/nav_state.hpp"

namespace fbvins {

using Mat32 = Eigen::Matrix<double, 3, 2>;
using Mat17 = Eigen::Matrix<double, 17, 17>;
using Mat15x17 = Eigen::Matrix<double, 15, 17>;

struct Tilt {
  Vec2 angle_rad = Vec2::Zero();  ///< the rotation vector (x, y, 0) takes z to up
  Vec3 pivot = Vec3::Zero();      ///< m, in G and in W: levelling does not move this point

  /// Takes directions in W to G (W13).
  Quat q() const { return so3_exp(rotation()); }
  Vec3 gravity_G(double gravity_mps2) const { return -gravity_mps2 * (q() * Vec3::UnitZ()); }

  /// d gravity_G / d angle (W14).
  Mat32 gravity_jacobian(double gravity_mps2) const {
    return -hat(gravity_G(gravity_mps2)) * so3_right_jacobian(-rotation()).leftCols<2>();
  }

  Vec3 levelled(const Vec3& p_G) const { return pivot + q().conjugate() * (p_G - pivot); }
  Pose<W, B> levelled(const Pose<G, B>& T_GB) const { return {(q().conjugate() * T_GB.q).normalized(), levelled(T_GB.p)}; }
  NavState<W> levelled(const NavState<G>& s) const { return {levelled(s.T_FB), q().conjugate() * s.v_FB, s.bias}; }

  /// d levelled state / d (p, theta, v, bg, ba, angle) (W16).
  Mat15x17 levelled_jacobian(const NavState<G>& s) const;
  /// From the covariance of (p, theta, v, bg, ba, angle) in the window.
  Mat15 levelled_covariance(const NavState<G>& s, const Mat17& covariance) const;

 private:
  Vec3 rotation() const { return {angle_rad.x(), angle_rad.y(), 0}; }
};

}  // namespace fbvins
