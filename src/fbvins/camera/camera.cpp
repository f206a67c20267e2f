// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/camera.hpp"

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

// Rays further than this from the axis (89.4 degrees) are outside of every model here.
constexpr double kLargestRadius = 100.0;

struct Radial {
  double value;       ///< distorted radius of an undistorted radius
  double derivative;  ///< d(value)/d(radius)
};

Radial radial(const PinholeRadtan& m, double r) {
  const double s = r * r;
  return {r * (1.0 + s * (m.k1 + s * m.k2)), 1.0 + s * (3.0 * m.k1 + s * 5.0 * m.k2)};
}

Radial radial(const KannalaBrandt& m, double r) {
  const double theta = std::atan(r);
  const double s = theta * theta;
  const double value = theta * (1.0 + s * (m.k1 + s * (m.k2 + s * (m.k3 + s * m.k4))));
  const double slope = 1.0 + s * (3.0 * m.k1 + s * (5.0 * m.k2 + s * (7.0 * m.k3 + s * 9.0 * m.k4)));
  return {value, slope / (1.0 + r * r)};
}

/// Distorted coordinates on the unit plane, with d(distorted)/d(normalised).
Vec2 distort_unit(const PinholeRadtan& m, const Vec2& n, Mat2* J) {
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

Vec2 distort_unit(const KannalaBrandt& m, const Vec2& n, Mat2* J) {
  const double s = n.squaredNorm();
  const double r = std::sqrt(s);
  // Near the axis value/r = 1 + (k1 - 1/3) r^2 + O(r^4): the quotients below lose their digits there.
  const bool near_axis = r < 1e-4;
  const Radial f = radial(m, r);
  const double a = near_axis ? 1.0 + (m.k1 - 1.0 / 3.0) * s : f.value / r;
  if (J) {
    const double b = near_axis ? 2.0 * (m.k1 - 1.0 / 3.0) : (f.derivative - a) / s;  // (da/dr) / r
    *J = a * Mat2::Identity() + b * n * n.transpose();
  }
  return a * n;
}

/// Where the radial distortion stops growing; kLargestRadius if it never does.
template <class Model>
double largest_radius(const Model& m) {
  // Steps of equal angle (0.1 degree), then bisection: a polynomial that turns for less than a step
  // has no usable part beyond it anyway.
  constexpr int kSteps = 900;
  double lo = 0;
  for (int i = 1; i <= kSteps; ++i) {
    double hi = std::min(kLargestRadius, std::tan(i * (std::atan(kLargestRadius) / kSteps)));
    if (radial(m, hi).derivative > 0) {
      lo = hi;
      continue;
    }
    for (int k = 0; k < 60; ++k) {
      const double mid = 0.5 * (lo + hi);
      (radial(m, mid).derivative > 0 ? lo : hi) = mid;
    }
    return lo;
  }
  return kLargestRadius;
}

/// Solves radial(r) = target on [0, largest] by Newton kept inside a shrinking bracket; the end of
/// the bracket where there is no solution (the 2-D iteration that follows then leaves the domain).
template <class Model>
double invert_radial(const Model& m, double target, double largest) {
  double lo = 0, hi = largest;
  double r = std::min(target, largest);
  for (int i = 0; i < 50; ++i) {
    const Radial f = radial(m, r);
    const double error = f.value - target;
    (error > 0 ? hi : lo) = r;
    double next = r - error / f.derivative;
    if (!(next >= lo && next <= hi)) next = 0.5 * (lo + hi);
    if (std::abs(next - r) <= 1e-6 * (1.0 + r)) return next;  // only a start for the 2-D iteration
    r = next;
  }
  return r;
}

}  // namespace

Camera::Camera(std::variant<PinholeRadtan, KannalaBrandt> model, int width, int height)
    : model_(std::move(model)), width_(width), height_(height) {
  max_radius_ = std::visit([](const auto& m) { return largest_radius(m); }, model_);
}

std::string Camera::model_name() const {
  return std::holds_alternative<PinholeRadtan>(model_) ? "pinhole-radtan" : "pinhole-equidistant";
}

double Camera::focal_px() const {
  return std::visit([](const auto& m) { return 0.5 * (m.fx + m.fy); }, model_);
}

Vec2 Camera::distort(const Vec2& normalised, Mat2* J_pixel_normalised) const {
  return std::visit(
      [&](const auto& m) -> Vec2 {
        const Vec2 d = distort_unit(m, normalised, J_pixel_normalised);
        if (J_pixel_normalised) {
          J_pixel_normalised->row(0) *= m.fx;
          J_pixel_normalised->row(1) *= m.fy;
        }
        return {m.fx * d.x() + m.cx, m.fy * d.y() + m.cy};
      },
      model_);
}

std::optional<Vec2> Camera::undistort(const Vec2& pixel) const {
  return std::visit(
      [&](const auto& m) -> std::optional<Vec2> {
        const Vec2 target((pixel.x() - m.cx) / m.fx, (pixel.y() - m.cy) / m.fy);
        const double distorted_radius = target.norm();
        if (!std::isfinite(distorted_radius)) return std::nullopt;
        Vec2 n = target;
        if (distorted_radius > 1e-12) n *= invert_radial(m, distorted_radius, max_radius_) / distorted_radius;
        Mat2 J;
        for (int i = 0; i < 20; ++i) {
          const Vec2 error = distort_unit(m, n, &J) - target;
          if (!(J.determinant() > 0) || !(n.squaredNorm() <= max_radius_ * max_radius_)) return std::nullopt;
          if (error.squaredNorm() < 1e-26) return n;
          const Vec2 step = J.inverse() * error;
          n -= step;
          // Far out the last digits of distort_unit keep the error above the absolute bound.
          if (step.squaredNorm() <= 1e-28 * n.squaredNorm())
            return n.norm() <= max_radius_ ? std::optional<Vec2>(n) : std::nullopt;
        }
        return std::nullopt;
      },
      model_);
}

std::optional<Vec2> Camera::project(const Vec3& p_C) const {
  if (!(p_C.z() > 1e-9)) return std::nullopt;
  const Vec2 n(p_C.x() / p_C.z(), p_C.y() / p_C.z());
  if (!(n.squaredNorm() <= max_radius_ * max_radius_)) return std::nullopt;
  Mat2 J;
  const Vec2 pixel = distort(n, &J);
  // The tangential part can fold the plane inside of the radial bound.
  if (!(J.determinant() > 0)) return std::nullopt;
  return pixel;
}

}  // namespace fbvins
