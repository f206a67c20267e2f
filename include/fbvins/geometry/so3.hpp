// SPDX-License-Identifier: Apache-2.0
// The rotation group: exponential, logarithm and the right Jacobian.
// Perturbation everywhere in this project: right (local), R <- R * Exp(dtheta). See docs/conventions.md.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

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
inline Quat so3_exp(const Vec3& theta) {
  const double t2 = theta.squaredNorm();
  const double t = std::sqrt(t2);
  // sin(t/2)/t by its series near zero: error below 1e-17 at the switch
  const double k = t < 1e-4 ? 0.5 - t2 / 48.0 : std::sin(0.5 * t) / t;
  const double w = t < 1e-4 ? 1.0 - t2 / 8.0 : std::cos(0.5 * t);
  return Quat(w, k * theta.x(), k * theta.y(), k * theta.z()).normalized();
}

/// Log: unit quaternion to rotation vector (rad), norm at most pi.
inline Vec3 so3_log(const Quat& q) {
  const Vec3 v = q.w() < 0 ? Vec3(-q.vec()) : Vec3(q.vec());
  const double w = std::abs(q.w());
  const double n2 = v.squaredNorm();
  const double n = std::sqrt(n2);
  const double k = n < 1e-7 ? 2.0 / w - 2.0 * n2 / (3.0 * w * w * w) : 2.0 * std::atan2(n, w) / n;
  return k * v;
}

/// The smallest rotation that takes the direction of `from` to that of `to`; where they are opposite, about some normal axis.
/// As Eigen's FromTwoVectors, without its singular value decomposition.
inline Quat so3_between(const Vec3& from, const Vec3& to) {
  const Vec3 a = from.normalized(), b = to.normalized();
  const double cosine = b.dot(a);
  if (cosine < -1 + 1e-12) {
    const Vec3 axis = a.unitOrthogonal();
    return Quat(0, axis.x(), axis.y(), axis.z());
  }
  const double twice_w = std::sqrt(2 * (1 + cosine));
  const Vec3 axis = a.cross(b) / twice_w;
  return Quat(0.5 * twice_w, axis.x(), axis.y(), axis.z());
}

/// Right Jacobian: Exp(theta + d) ~ Exp(theta) * Exp(Jr(theta) * d).
inline Mat3 so3_right_jacobian(const Vec3& theta) {
  const double t2 = theta.squaredNorm();
  const Mat3 h = hat(theta);
  if (t2 < 1e-8) return Mat3::Identity() - 0.5 * h + h * h / 6.0;
  const double t = std::sqrt(t2);
  return Mat3::Identity() - (1.0 - std::cos(t)) / t2 * h + (t - std::sin(t)) / (t2 * t) * h * h;
}

/// Inverse of the right Jacobian: Log(Exp(theta) * Exp(d)) ~ theta + Jr^-1(theta) * d, for |theta| < pi.
inline Mat3 so3_right_jacobian_inverse(const Vec3& theta) {
  const double t2 = theta.squaredNorm();
  const Mat3 h = hat(theta);
  if (t2 < 1e-8) return Mat3::Identity() + 0.5 * h + h * h / 12.0;
  const double t = std::sqrt(t2);
  return Mat3::Identity() + 0.5 * h + (1.0 / t2 - (1.0 + std::cos(t)) / (2.0 * t * std::sin(t))) * h * h;
}

}  // namespace fbvins
