// SPDX-License-Identifier: Apache-2.0
// Private to camera: the lens models on the unit plane. For a model m:
//   radial(m, r)             distorted radius of a radius, without tangential distortion, and its derivative
//   distort_unit(m, n, J)    (u, v) of n = (x/z, y/z), with d(u, v)/dn
//   undistort_unit(m, uv)    the inverse, of models that have one in closed form; nullopt where the ray does not point forward
//   ray_unit(m, uv)          a ray of (u, v), in any direction and of any length, of models that have it in closed form
//   coefficients(m)          its parameters after fx, fy, cx, cy
// A radially symmetric model is (u, v) = a(s) n with s = |n|^2, and its Jacobian a I + b n n^T with b = 2 da/ds.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <type_traits>
#include <vector>

#include "fbvins/camera/lens_models.hpp"
#include "fbvins/geometry/pose.hpp"

namespace fbvins {

struct Radial {
  double value;       ///< distorted radius of an undistorted radius
  double derivative;  ///< d(value)/d(radius)
};

inline Radial radial(const PinholeRadtan& m, double r) {
  const double s = r * r;
  return {r * (1.0 + s * (m.k1 + s * m.k2)), 1.0 + s * (3.0 * m.k1 + s * 5.0 * m.k2)};
}

/// Distorted radius of an angle from the axis, rad.
inline Radial radial_of_angle(const KannalaBrandt& m, double theta) {
  const double s = theta * theta;
  return {theta * (1.0 + s * (m.k1 + s * (m.k2 + s * (m.k3 + s * m.k4)))),
          1.0 + s * (3.0 * m.k1 + s * (5.0 * m.k2 + s * (7.0 * m.k3 + s * 9.0 * m.k4)))};
}

inline Radial radial(const KannalaBrandt& m, double r) {
  const auto [value, slope] = radial_of_angle(m, std::atan(r));
  return {value, slope / (1.0 + r * r)};
}

/// Distorted coordinates on the unit plane, with d(distorted)/d(normalised).
inline Vec2 distort_unit(const PinholeRadtan& m, const Vec2& n, Mat2* J) {
  const double x = n.x(), y = n.y();
  const double xx = x * x, yy = y * y, xy = x * y, s = xx + yy;
  const double a = 1.0 + s * (m.k1 + s * m.k2);
  if (J) {
    const double b = 2.0 * m.k1 + 4.0 * s * m.k2;  // (da/dr) / r
    const double off_diagonal = b * xy + 2.0 * m.p1 * x + 2.0 * m.p2 * y;
    *J << a + b * xx + 2.0 * m.p1 * y + 6.0 * m.p2 * x, off_diagonal,  //
        off_diagonal, a + b * yy + 6.0 * m.p1 * y + 2.0 * m.p2 * x;
  }
  return {a * x + 2.0 * m.p1 * xy + m.p2 * (s + 2.0 * xx), a * y + m.p1 * (s + 2.0 * yy) + 2.0 * m.p2 * xy};
}

inline Vec2 distort_unit(const KannalaBrandt& m, const Vec2& n, Mat2* J) {
  const double s = n.squaredNorm();
  const double r = std::sqrt(s);
  // Near the axis value/r = 1 + (k1 - 1/3) r^2 + O(r^4), where the quotients below would cancel.
  const bool near_axis = r < 1e-4;
  const Radial f = radial(m, r);
  const double a = near_axis ? 1.0 + (m.k1 - 1.0 / 3.0) * s : f.value / r;
  if (J) {
    const double b = near_axis ? 2.0 * (m.k1 - 1.0 / 3.0) : (f.derivative - a) / s;  // (da/dr) / r
    *J = a * Mat2::Identity() + b * n * n.transpose();
  }
  return a * n;
}

/// A radially symmetric model's a and b at s.
struct Scaling {
  double a;
  double b;
};

/// The radial part of Brown's distortion with more than two coefficients: a = N/D.
inline Scaling scaling(const PinholeRadtan5& m, double s) {
  return {1.0 + s * (m.k1 + s * (m.k2 + s * m.k3)), 2.0 * (m.k1 + s * (2.0 * m.k2 + s * 3.0 * m.k3))};
}

inline Scaling scaling(const PinholeRational& m, double s) {
  const double N = 1.0 + s * (m.k1 + s * (m.k2 + s * m.k3)), D = 1.0 + s * (m.k4 + s * (m.k5 + s * m.k6));
  if (!(D > 0)) return {0, 0};  // beyond a pole; a derivative of zero ends the model's domain in Camera
  const double dN = m.k1 + s * (2.0 * m.k2 + s * 3.0 * m.k3), dD = m.k4 + s * (2.0 * m.k5 + s * 3.0 * m.k6);
  return {N / D, 2.0 * (dN * D - N * dD) / (D * D)};
}

template <class Model>
concept LongBrown = std::is_same_v<Model, PinholeRadtan5> || std::is_same_v<Model, PinholeRational>;

template <LongBrown Model>
Radial radial(const Model& m, double r) {
  const Scaling f = scaling(m, r * r);
  return {f.a * r, f.a + f.b * r * r};
}

template <LongBrown Model>
Vec2 distort_unit(const Model& m, const Vec2& n, Mat2* J) {
  const double x = n.x(), y = n.y(), xy = x * y, s = n.squaredNorm();
  const Scaling f = scaling(m, s);
  if (J) {
    const double off_diagonal = f.b * xy + 2.0 * m.p1 * x + 2.0 * m.p2 * y;
    *J << f.a + f.b * x * x + 2.0 * m.p1 * y + 6.0 * m.p2 * x, off_diagonal,  //
        off_diagonal, f.a + f.b * y * y + 6.0 * m.p1 * y + 2.0 * m.p2 * x;
  }
  return {f.a * x + 2.0 * m.p1 * xy + m.p2 * (s + 2.0 * x * x), f.a * y + m.p1 * (s + 2.0 * y * y) + 2.0 * m.p2 * xy};
}

inline Radial radial_of(const Scaling& f, double r) { return {f.a * r, f.a + f.b * r * r}; }

inline Vec2 scaled(const Scaling& f, const Vec2& n, Mat2* J) {
  if (J) *J = f.a * Mat2::Identity() + f.b * n * n.transpose();
  return f.a * n;
}

/// With D = alpha d2 + (1 - alpha) w: a = 1/D and b = -2 a^2 dD/ds, where 2 d(d1)/ds = 1/d1, 2 dw/ds = xi/d1 and
/// 2 d(d2)/ds = (1 + w xi/d1)/d2.
inline Scaling scaling(const DoubleSphere& m, double s) {
  const double d1 = std::sqrt(s + 1.0), w = m.xi * d1 + 1.0, d2 = std::sqrt(s + w * w);
  const double D = m.alpha * d2 + (1.0 - m.alpha) * w;
  if (!(D > 0)) return {0, 0};  // outside the model's domain; a derivative of zero ends it in Camera
  const double a = 1.0 / D, slope = m.xi / d1;
  return {a, -a * a * (m.alpha * (1.0 + w * slope) / d2 + (1.0 - m.alpha) * slope)};
}

/// With D = alpha d + 1 - alpha: a = 1/D and b = -2 a^2 dD/ds, where 2 d(d)/ds = beta/d.
inline Scaling scaling(const ExtendedUnified& m, double s) {
  const double d = std::sqrt(m.beta * s + 1.0), a = 1.0 / (m.alpha * d + 1.0 - m.alpha);
  return {a, -a * a * m.alpha * m.beta / d};
}

/// Mei's projection, before its distortion: a = 1/(xi d + 1) with d = sqrt(s + 1).
inline Scaling scaling(const UnifiedRadtan& m, double s) {
  const double d = std::sqrt(s + 1.0), a = 1.0 / (m.xi * d + 1.0);
  return {a, -a * a * m.xi / d};
}

inline Radial radial(const DoubleSphere& m, double r) { return radial_of(scaling(m, r * r), r); }
inline Radial radial(const ExtendedUnified& m, double r) { return radial_of(scaling(m, r * r), r); }
inline Vec2 distort_unit(const DoubleSphere& m, const Vec2& n, Mat2* J) { return scaled(scaling(m, n.squaredNorm()), n, J); }
inline Vec2 distort_unit(const ExtendedUnified& m, const Vec2& n, Mat2* J) { return scaled(scaling(m, n.squaredNorm()), n, J); }

inline PinholeRadtan behind(const UnifiedRadtan& m) { return {m.fx, m.fy, m.cx, m.cy, m.k1, m.k2, m.p1, m.p2}; }

inline Radial radial(const UnifiedRadtan& m, double r) {
  const Radial first = radial_of(scaling(m, r * r), r), second = radial(behind(m), first.value);
  return {second.value, second.derivative * first.derivative};
}

inline Vec2 distort_unit(const UnifiedRadtan& m, const Vec2& n, Mat2* J) {
  Mat2 J_first;
  const Vec2 first = scaled(scaling(m, n.squaredNorm()), n, J ? &J_first : nullptr);
  const Vec2 second = distort_unit(behind(m), first, J);
  if (J) *J *= J_first;
  return second;
}

/// The ray (k u, k v, z) of (u, v).
struct LiftedRay {
  double k, z;
};

/// Usenko et al., equations 46 to 50: the ray meets the second sphere at height m_z, then the first one.
inline std::optional<LiftedRay> lift(const DoubleSphere& m, const Vec2& uv) {
  const double s = uv.squaredNorm(), root = 1.0 - (2.0 * m.alpha - 1.0) * s;
  if (!(root >= 0)) return std::nullopt;
  const double height = (1.0 - m.alpha * m.alpha * s) / (m.alpha * std::sqrt(root) + 1.0 - m.alpha);
  const double square = height * height + (1.0 - m.xi * m.xi) * s;
  if (!(square >= 0)) return std::nullopt;
  const double k = (height * m.xi + std::sqrt(square)) / (height * height + s);
  if (!(k > 0)) return std::nullopt;
  return LiftedRay{k, k * height - m.xi};
}

/// Khomutenko et al.; in the notation of Usenko et al., equations 37 to 39.
inline std::optional<LiftedRay> lift(const ExtendedUnified& m, const Vec2& uv) {
  const double s = m.beta * uv.squaredNorm(), root = 1.0 - (2.0 * m.alpha - 1.0) * s;
  if (!(root >= 0)) return std::nullopt;
  return LiftedRay{1, (1.0 - m.alpha * m.alpha * s) / (m.alpha * std::sqrt(root) + 1.0 - m.alpha)};
}

inline std::optional<Vec2> undistort_unit(const DoubleSphere& m, const Vec2& uv) {
  const auto ray = lift(m, uv);
  return ray && ray->z > 0 ? std::optional<Vec2>((ray->k / ray->z) * uv) : std::nullopt;
}

inline std::optional<Vec2> undistort_unit(const ExtendedUnified& m, const Vec2& uv) {
  const auto ray = lift(m, uv);
  return ray && ray->z > 0 ? std::optional<Vec2>(uv / ray->z) : std::nullopt;
}

template <class Model>
requires requires(const Model& m, const Vec2& uv) { lift(m, uv); }
std::optional<Vec3> ray_unit(const Model& m, const Vec2& uv) {
  const auto ray = lift(m, uv);
  return ray ? std::optional<Vec3>(Vec3(ray->k * uv.x(), ray->k * uv.y(), ray->z)) : std::nullopt;
}

/// Mei and Rives: the ray of a point on the plane before the distortion.
inline Vec3 ray_before_distortion(const UnifiedRadtan& m, const Vec2& uv) {
  const double s = uv.squaredNorm(), k = (m.xi + std::sqrt(std::max(0.0, 1.0 + (1.0 - m.xi * m.xi) * s))) / (1.0 + s);
  return {k * uv.x(), k * uv.y(), k - m.xi};
}

inline std::vector<double> coefficients(const PinholeRadtan& m) { return {m.k1, m.k2, m.p1, m.p2}; }
inline std::vector<double> coefficients(const KannalaBrandt& m) { return {m.k1, m.k2, m.k3, m.k4}; }
inline std::vector<double> coefficients(const PinholeRadtan5& m) { return {m.k1, m.k2, m.p1, m.p2, m.k3}; }
inline std::vector<double> coefficients(const PinholeRational& m) { return {m.k1, m.k2, m.p1, m.p2, m.k3, m.k4, m.k5, m.k6}; }
inline std::vector<double> coefficients(const DoubleSphere& m) { return {m.xi, m.alpha}; }
inline std::vector<double> coefficients(const ExtendedUnified& m) { return {m.alpha, m.beta}; }
inline std::vector<double> coefficients(const UnifiedRadtan& m) { return {m.xi, m.k1, m.k2, m.p1, m.p2}; }

}  // namespace fbvins
