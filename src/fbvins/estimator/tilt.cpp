// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/tilt.hpp"

namespace fbvins {

Mat15x17 Tilt::levelled_jacobian(const NavState<G>& s) const {
  const Mat3 R = q().conjugate().toRotationMatrix();
  const NavState<W> level = levelled(s);
  const Mat32 turn = -so3_right_jacobian(rotation()).leftCols<2>();  // dphi by the angle (W16)
  Mat15x17 J = Mat15x17::Zero();
  J.leftCols<15>().setIdentity();
  J.block<3, 3>(nav::p, nav::p) = J.block<3, 3>(nav::v, nav::v) = R;
  J.block<3, 2>(nav::p, 15) = -hat(level.T_FB.p - pivot) * turn;
  J.block<3, 2>(nav::theta, 15) = level.T_FB.R().transpose() * turn;
  J.block<3, 2>(nav::v, 15) = -hat(level.v_FB) * turn;
  return J;
}

Mat15 Tilt::levelled_covariance(const NavState<G>& s, const Mat17& covariance) const {
  const Mat15x17 J = levelled_jacobian(s);
  return J * covariance * J.transpose();
}

}  // namespace fbvins
