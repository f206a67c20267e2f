// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/lens_projection.hpp"

#include <cmath>
#include <initializer_list>

#include "fbvins/camera/lenses.hpp"

namespace fbvins {
namespace {

using Row23 = Eigen::Matrix<double, 2, 3>;
using OwnJacobian = Eigen::Matrix<double, 2, kMostLensParameters - 4>;

/// A point on the model's plane, before focal lengths and centre.
struct Unit {
  Vec2 uv;
  Row23 J_point;
  OwnJacobian J_own = OwnJacobian::Zero();  ///< of the parameters after cy
};

/// (u, v) = (x, y) / D with the derivatives of D; `first` to `own` of D's own parameters.
Unit quotient(const Vec3& p, double D, const Vec3& dD_point, std::initializer_list<double> dD_own) {
  Unit out;
  out.uv = p.head<2>() / D;
  out.J_point = -out.uv * dD_point.transpose() / D;
  out.J_point(0, 0) += 1 / D;
  out.J_point(1, 1) += 1 / D;
  int k = 0;
  for (const double d : dD_own) out.J_own.col(k++) = -out.uv * d / D;
  return out;
}

/// Brown's distortion of (u, v) with the derivatives of k1, k2, p1, p2.
Vec2 brown(const PinholeRadtan& m, const Vec2& n, Mat2& J, Eigen::Matrix<double, 2, 4>& J_own) {
  const double x = n.x(), y = n.y(), s = n.squaredNorm();
  J_own << x * s, x * s * s, 2 * x * y, s + 2 * x * x, y * s, y * s * s, s + 2 * y * y, 2 * x * y;
  return distort_unit(m, n, &J);
}

std::optional<Unit> unit(const PinholeRadtan& m, const Vec3& p) {
  if (!(p.z() > 1e-3 * p.norm())) return std::nullopt;
  Unit out = quotient(p, p.z(), Vec3::UnitZ(), {});
  if (!(radial(m, out.uv.norm()).derivative > 0)) return std::nullopt;
  Mat2 J;
  Eigen::Matrix<double, 2, 4> J_own;
  out.uv = brown(m, out.uv, J, J_own);
  out.J_point = (J * out.J_point).eval();
  out.J_own.leftCols<4>() = J_own;
  return out;
}

/// Of k1, k2, p1, p2, k3, and of a rational model k4, k5, k6.
template <LongBrown Model>
OwnJacobian own_derivatives(const Model& m, const Vec2& n) {
  const double x = n.x(), y = n.y(), s = n.squaredNorm();
  const auto D = [&] {
    if constexpr (requires { m.k4; }) return 1.0 + s * (m.k4 + s * (m.k5 + s * m.k6));
    else return 1.0;
  }();
  OwnJacobian J = OwnJacobian::Zero();
  J.col(0) = s / D * n;
  J.col(1) = s * s / D * n;
  J.col(2) << 2 * x * y, s + 2 * y * y;
  J.col(3) << s + 2 * x * x, 2 * x * y;
  J.col(4) = s * s * s / D * n;
  if constexpr (requires { m.k4; }) {
    const double a = scaling(m, s).a;
    double power = 1;
    for (int k = 5; k < 8; ++k) J.col(k) = -a * (power *= s) / D * n;
  }
  return J;
}

template <LongBrown Model>
std::optional<Unit> unit(const Model& m, const Vec3& p) {
  if (!(p.z() > 1e-3 * p.norm())) return std::nullopt;
  Unit out = quotient(p, p.z(), Vec3::UnitZ(), {});
  if (!(radial(m, out.uv.norm()).derivative > 0)) return std::nullopt;
  Mat2 J;
  out.J_own = own_derivatives(m, out.uv);
  out.uv = distort_unit(m, out.uv, &J);
  out.J_point = (J * out.J_point).eval();
  return out;
}

std::optional<Unit> unit(const KannalaBrandt& m, const Vec3& p) {
  const double r = p.head<2>().norm(), square = p.squaredNorm();
  if (r < 1e-9 * p.z()) return quotient(p, p.z(), Vec3::UnitZ(), {});
  const double theta = std::atan2(r, p.z()), s = theta * theta;
  const double g = theta * (1 + s * (m.k1 + s * (m.k2 + s * (m.k3 + s * m.k4))));
  const double slope = 1 + s * (3 * m.k1 + s * (5 * m.k2 + s * (7 * m.k3 + s * 9 * m.k4)));
  if (!(slope > 0) || !(g > 0) || !(r > 0)) return std::nullopt;
  Unit out;
  const Vec2 direction = p.head<2>() / r;
  out.uv = g * direction;
  const Vec3 d_theta(p.z() * direction.x() / square, p.z() * direction.y() / square, -r / square);
  out.J_point = slope * direction * d_theta.transpose();
  out.J_point.leftCols<2>() += g / r * (Mat2::Identity() - direction * direction.transpose());
  double power = theta;
  for (int k = 0; k < 4; ++k) out.J_own.col(k) = (power *= s) * direction;
  return out;
}

std::optional<Unit> unit(const DoubleSphere& m, const Vec3& p) {
  const double d1 = p.norm(), w = m.xi * d1 + p.z(), d2 = std::hypot(p.x(), p.y(), w);
  const double D = m.alpha * d2 + (1 - m.alpha) * w;
  // Usenko et al., equations 43 to 45.
  const double w1 = m.alpha <= 0.5 ? m.alpha / (1 - m.alpha) : (1 - m.alpha) / m.alpha;
  const double w2 = (w1 + m.xi) / std::sqrt(2 * w1 * m.xi + m.xi * m.xi + 1);
  if (!(p.z() > -w2 * d1) || !(D > 1e-9 * d1)) return std::nullopt;
  const Vec3 dw = m.xi * p / d1 + Vec3::UnitZ();
  const Vec3 dd2 = (Vec3(p.x(), p.y(), 0) + w * dw) / d2;
  return quotient(p, D, m.alpha * dd2 + (1 - m.alpha) * dw, {d1 * (m.alpha * w / d2 + 1 - m.alpha), d2 - w});
}

std::optional<Unit> unit(const ExtendedUnified& m, const Vec3& p) {
  const double rr = p.head<2>().squaredNorm(), d = std::sqrt(m.beta * rr + p.z() * p.z());
  const double D = m.alpha * d + (1 - m.alpha) * p.z();
  const double bound = m.alpha <= 0.5 ? m.alpha / (1 - m.alpha) : (1 - m.alpha) / m.alpha;
  if (!(p.z() > -bound * d) || !(D > 1e-9 * d)) return std::nullopt;
  const Vec3 dd = Vec3(m.beta * p.x(), m.beta * p.y(), p.z()) / d;
  return quotient(p, D, m.alpha * dd + (1 - m.alpha) * Vec3::UnitZ(), {d - p.z(), m.alpha * rr / (2 * d)});
}

std::optional<Unit> unit(const UnifiedRadtan& m, const Vec3& p) {
  const double d = p.norm(), D = m.xi * d + p.z();
  if (!(p.z() > -(m.xi <= 1 ? m.xi : 1 / m.xi) * d) || !(D > 1e-9 * d)) return std::nullopt;
  Unit out = quotient(p, D, m.xi * p / d + Vec3::UnitZ(), {d});
  const PinholeRadtan second = behind(m);
  if (!(radial(second, out.uv.norm()).derivative > 0)) return std::nullopt;
  Mat2 J;
  Eigen::Matrix<double, 2, 4> J_own;
  out.uv = brown(second, out.uv, J, J_own);
  out.J_point = (J * out.J_point).eval();
  out.J_own.col(0) = (J * out.J_own.col(0)).eval();
  out.J_own.middleCols<4>(1) = J_own;
  return out;
}

}  // namespace

std::optional<Vec2> project_point(const LensModel& lens, const Vec3& p_C, LensDerivatives* derivatives) {
  return std::visit(
      [&](const auto& m) -> std::optional<Vec2> {
        const std::optional<Unit> point = unit(m, p_C);
        if (!point || !point->uv.allFinite()) return std::nullopt;
        const Vec2 focal(m.fx, m.fy);
        if (derivatives) {
          derivatives->point = focal.asDiagonal() * point->J_point;
          derivatives->parameters.setZero();
          derivatives->parameters(0, 0) = point->uv.x();
          derivatives->parameters(1, 1) = point->uv.y();
          derivatives->parameters(0, 2) = derivatives->parameters(1, 3) = 1;
          derivatives->parameters.rightCols<kMostLensParameters - 4>() = focal.asDiagonal() * point->J_own;
        }
        return Vec2(m.fx * point->uv.x() + m.cx, m.fy * point->uv.y() + m.cy);
      },
      lens);
}

}  // namespace fbvins
