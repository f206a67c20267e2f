// SPDX-License-Identifier: Apache-2.0
// The rotation group: exponential, logarithm and the right Jacobian.
// Perturbation everywhere in this project: right (local), R <- R * Exp(dtheta). See docs/conventions.md.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace fbvins {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat2 = Eigen::Matrix2d;
using Mat3 = Eigen::Matrix3d;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using Quat = Eigen::Quaterniond;

/// Skew-symmetric matrix: hat(a) * b == a x b.
inline Mat3 hat(const Vec3& a) {
  Mat3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// Exp: rotation vector (rad) to unit quaternion.
Quat so3_exp(const Vec3& theta);

/// Log: unit quaternion to rotation vector (rad), norm at most pi.
Vec3 so3_log(const Quat& q);

/// The smallest rotation that takes the direction of `from` to that of `to`; where they are opposite, about some normal axis.
/// As Eigen's FromTwoVectors, without its singular value decomposition.
Quat so3_between(const Vec3& from, const Vec3& to);

/// Right Jacobian: Exp(theta + d) ~ Exp(theta) * Exp(Jr(theta) * d).
Mat3 so3_right_jacobian(const Vec3& theta);

/// Inverse of the right Jacobian: Log(Exp(theta) * Exp(d)) ~ theta + Jr^-1(theta) * d, for |theta| < pi.
Mat3 so3_right_jacobian_inverse(const Vec3& theta);

}  // namespace fbvins
