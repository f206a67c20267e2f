// SPDX-License-Identifier: Apache-2.0
// The motion of the body at another point and in other axes of it, such as those of the vehicle that carries the IMU.
#pragma once

#include "fbvins/geometry/pose.hpp"

namespace fbvins {

/// Of the frame X, which is fixed to the body.
template <class X>
struct MotionAt {
  Pose<W, X> T_WX;
  Vec3 v_WX = Vec3::Zero();                 ///< m/s, in W
  Vec3 w_WX_X = Vec3::Zero();               ///< rad/s, in X
  Mat6 pose_covariance = Mat6::Zero();      ///< of (dp in W [m], dtheta in X [rad])
  Mat3 velocity_covariance = Mat3::Zero();  ///< of v_WX, without what the noise of the rate adds at the distance of X
};

/// `body`: an Odometry, or a LivePose.
template <class X, class Body>
MotionAt<X> motion_at(const Pose<B, X>& T_BX, const Body& body) {
  const Mat3 R_WB = body.T_WB.R();
  Mat6 J = Mat6::Identity();  // an error of attitude moves X
  J.template topRightCorner<3, 3>() = -R_WB * hat(T_BX.p);
  J.template bottomRightCorner<3, 3>() = T_BX.R().transpose();
  MotionAt<X> out;
  out.T_WX = body.T_WB * T_BX;
  out.v_WX = body.v_WB + R_WB * body.w_WB_B.cross(T_BX.p);
  out.w_WX_X = T_BX.q.conjugate() * body.w_WB_B;
  out.pose_covariance = J * body.pose_covariance * J.transpose();
  out.velocity_covariance = body.velocity_covariance;
  return out;
}

}  // namespace fbvins
