// SPDX-License-Identifier: Apache-2.0
// Pose<To, From>: takes coordinates in frame From to frame To. Inner letters cancel:
//
//   Pose<W, C0> T_WC0 = T_WB * T_BC0;   // Pose<W, B> * Pose<B, C0>
//   Vec3 p_W = T_WB * p_B;
//
// A product whose inner frames differ does not compile (pose_test.cpp says so).
#pragma once

#include "fbvins/geometry/so3.hpp"

namespace fbvins {

/// Odometry frame: z up as far as gravity is known, origin and heading from the start. Loop closure never moves W, and only
/// a restart begins a new one; poses in W are corrected when landmarks are re-observed and while W is levelled.
struct W {};
struct M {};   ///< map: W corrected by loop closure
struct B {};   ///< body = IMU
struct C0 {};  ///< left camera, z forward, x right, y down
struct C1 {};  ///< right camera

template <class To, class From>
struct Pose {
  Quat q = Quat::Identity();  ///< Hamilton, unit
  Vec3 p = Vec3::Zero();      ///< origin of From in To, metres

  Pose() = default;
  Pose(const Quat& rotation, const Vec3& position) : q(rotation), p(position) {}
  Pose(const Mat3& rotation, const Vec3& position) : q(Quat(rotation).normalized()), p(position) {}

  Mat3 R() const { return q.toRotationMatrix(); }
  Pose<From, To> inverse() const {
    const Quat qi = q.conjugate();
    return {qi, Vec3(-(qi * p))};
  }
  template <class Next>
  Pose<To, Next> operator*(const Pose<From, Next>& other) const {
    return {(q * other.q).normalized(), Vec3(p + q * other.p)};
  }
  Vec3 operator*(const Vec3& point_From) const { return q * point_From + p; }

  /// Adds the perturbation (dp in To, dtheta in From): p + dp, q * Exp(dtheta).
  Pose boxplus(const Vec3& dp, const Vec3& dtheta) const { return {(q * so3_exp(dtheta)).normalized(), Vec3(p + dp)}; }

  /// The same numbers under other frame names; only where a physical identity justifies it: a file's sensor is the left
  /// camera, the world of a start is the odometry's. Never between W and M, which loop closure moves apart.
  template <class To2, class From2>
  Pose<To2, From2> cast_frames() const {
    return {q, p};
  }
};

}  // namespace fbvins
