// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/so3.hpp"

#include <cmath>

namespace fbvins {

Quat so3_exp(const Vec3& theta) {
  const double t2 = theta.squaredNorm();
  const double t = std::sqrt(t2);
  // sin(t/2)/t by its series near zero: error below 1e-17 at the switch
  const double k = t < 1e-4 ? 0.5 - t2 / 48.0 : std::sin(0.5 * t) / t;
  const double w = t < 1e-4 ? 1.0 - t2 / 8.0 : std::cos(0.5 * t);
  return Quat(w, k * theta.x(), k * theta.y(), k * theta.z()).normalized();
}

Vec3 so3_log(const Quat& q) {
  const Vec3 v = q.w() < 0 ? Vec3(-q.vec()) : Vec3(q.vec());
  const double w = std::abs(q.w());
  const double n2 = v.squaredNorm();
  const double n = std::sqrt(n2);
  const double k = n < 1e-7 ? 2.0 / w - 2.0 * n2 / (3.0 * w * w * w) : 2.0 * std::atan2(n, w) / n;
  return k * v;
}

Quat so3_between(const Vec3& from, const Vec3& to) {
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

Mat3 so3_right_jacobian(const Vec3& theta) {
  const double t2 = theta.squaredNorm();
  const Mat3 h = hat(theta);
  if (t2 < 1e-8) return Mat3::Identity() - 0.5 * h + h * h / 6.0;
  const double t = std::sqrt(t2);
  return Mat3::Identity() - (1.0 - std::cos(t)) / t2 * h + (t - std::sin(t)) / (t2 * t) * h * h;
}

Mat3 so3_right_jacobian_inverse(const Vec3& theta) {
  const double t2 = theta.squaredNorm();
  const Mat3 h = hat(theta);
  if (t2 < 1e-8) return Mat3::Identity() + 0.5 * h + h * h / 12.0;
  const double t = std::sqrt(t2);
  return Mat3::Identity() + 0.5 * h + (1.0 / t2 - (1.0 + std::cos(t)) / (2.0 * t * std::sin(t))) * h * h;
}

}  // namespace fbvins
