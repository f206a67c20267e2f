// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/camera.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <type_traits>

#include "fbvins/camera/lens_projection.hpp"
#include "fbvins/camera/lenses.hpp"

namespace fbvins {
namespace {

// Rays farther than this from the axis (89.4 degrees) are outside the domain of every model.
constexpr double kLargestRadius = 100.0;

/// Radius at which the radial distortion stops growing; kLargestRadius if it never does.
template <class Model>
double largest_radius(const Model& m) {
  // Steps of equal angle (0.1 degree), then bisection. A polynomial that decreases for less than a step is taken as
  // growing there.
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

/// Solves radial_at(r).value = target on [0, largest] by Newton's method inside a shrinking bracket. Gives the end of the
/// bracket where there is no solution (the 2-D iteration that follows then leaves the domain).
template <class Function>
double invert_radial(const Function& radial_at, double target, double largest, double tolerance) {
  double lo = 0, hi = largest;
  double r = std::min(target, largest);
  for (int i = 0; i < 50; ++i) {
    const Radial f = radial_at(r);
    const double error = f.value - target;
    (error > 0 ? hi : lo) = r;
    double next = r - error / f.derivative;
    if (!(next >= lo && next <= hi)) next = 0.5 * (lo + hi);
    if (std::abs(next - r) <= tolerance * (1.0 + r)) return next;
    r = next;
  }
  return r;
}

/// Solves distort_unit(n) = target by Newton's method, starting from the solution for the radial part alone.
template <class Model>
std::optional<Vec2> undistort_by_newton(const Model& m, const Vec2& target, double max_radius) {
  const double distorted_radius = target.norm();
  Vec2 n = target;
  const auto radial_at = [&](double r) { return radial(m, r); };
  constexpr double kTolerance = 1e-6;  // only a start for the 2-D iteration
  if (distorted_radius > 1e-12) n *= invert_radial(radial_at, distorted_radius, max_radius, kTolerance) / distorted_radius;
  Mat2 J;
  for (int i = 0; i < 20; ++i) {
    const Vec2 error = distort_unit(m, n, &J) - target;
    if (!(J.determinant() > 0) || !(n.squaredNorm() <= max_radius * max_radius)) return std::nullopt;
    if (error.squaredNorm() < 1e-26) return n;
    const Vec2 step = J.inverse() * error;
    n -= step;
    // Far from the axis rounding in distort_unit keeps the error above the absolute bound.
    if (step.squaredNorm() <= 1e-28 * n.squaredNorm()) return n.norm() <= max_radius ? std::optional<Vec2>(n) : std::nullopt;
  }
  return std::nullopt;
}

/// Angle from the axis up to which the image radius grows, to 1e-4 rad. `project`: the pixel of a point, where there is one.
template <class Project>
double widest_angle(const Vec2& centre, const Project& project) {
  const auto radius_at = [&](double angle) {
    const std::optional<Vec2> px = project(Vec3(std::sin(angle), 0, std::cos(angle)));
    return px ? (*px - centre).norm() : -1;
  };
  double angle = 0, before = 0;
  for (const double step : {1e-2, 1e-4})
    while (angle + step < std::numbers::pi) {
      const double radius = radius_at(angle + step);
      if (!(radius > before)) break;
      before = radius;
      angle += step;
    }
  return angle;
}

/// Radius on the plane that Brown's distortion is of, up to which that grows; of a model without it the largest.
template <class Model>
double largest_plane_radius(const Model& m) {
  if constexpr (requires { behind(m); }) return largest_radius(behind(m));
  else return largest_radius(m);
}

/// Direction of a point of the unit plane.
template <class Model>
std::optional<Vec3> direction_of(const Model& m, const Vec2& uv, double widest, double largest_plane_radius) {
  if constexpr (requires { ray_unit(m, uv); }) {
    return ray_unit(m, uv);
  } else if constexpr (std::is_same_v<Model, UnifiedRadtan>) {
    const auto plane = undistort_by_newton(behind(m), uv, largest_plane_radius);
    return plane ? std::optional<Vec3>(ray_before_distortion(m, *plane)) : std::nullopt;
  } else if constexpr (std::is_same_v<Model, KannalaBrandt>) {
    const double radius = uv.norm();
    if (radius < 1e-12) return Vec3::UnitZ();
    if (radius > radial_of_angle(m, widest).value) return std::nullopt;
    const double angle = invert_radial([&](double a) { return radial_of_angle(m, a); }, radius, widest, 1e-14);
    const Vec2 across = std::sin(angle) / radius * uv;
    return Vec3(across.x(), across.y(), std::cos(angle));
  } else {
    const auto plane = undistort_by_newton(m, uv, largest_plane_radius);
    return plane ? std::optional<Vec3>(plane->homogeneous()) : std::nullopt;
  }
}

}  // namespace

Camera::Camera(LensModel model, int width, int height) : model_(std::move(model)), width_(width), height_(height) {
  max_radius_ = std::visit([](const auto& m) { return largest_radius(m); }, model_);
  max_plane_radius_ = std::visit([](const auto& m) { return largest_plane_radius(m); }, model_);
  const auto f = intrinsics();
  widest_rad_ = widest_angle({f[2], f[3]}, [this](const Vec3& p) { return project_point(model_, p); });
}

Camera::Camera(std::shared_ptr<const Lens> lens, int width, int height) : lens_(std::move(lens)), width_(width), height_(height) {
  const auto f = lens_->intrinsics();
  model_ = PinholeRadtan{f[0], f[1], f[2], f[3]};
  widest_rad_ = widest_angle({f[2], f[3]}, [this](const Vec3& p) { return lens_->project(p, nullptr); });
  max_radius_ = widest_rad_ < std::numbers::pi / 2 ? std::min(kLargestRadius, std::tan(widest_rad_)) : kLargestRadius;
  max_plane_radius_ = max_radius_;
}

Camera Camera::with_lens(LensModel model) const {
  Camera out(std::move(model), width_, height_);
  out.mask_ = mask_;
  out.own_times_ = own_times_;
  return out;
}

Camera Camera::turned(const Mat3& R_lens) const {
  Camera out = *this;
  out.R_lens_ = R_lens;
  out.is_turned_ = true;
  return out;
}

std::string Camera::model_name() const {
  if (lens_) return lens_->name();
  constexpr const char* kNames[] = {"pinhole-radtan",  "pinhole-equidistant", "ds", "eucm", "omni-radtan",
                                    "pinhole-radtan5", "pinhole-rational"};
  static_assert(std::size(kNames) == std::variant_size_v<LensModel>);
  return kNames[model_.index()];
}

std::array<double, 4> Camera::intrinsics() const {
  return std::visit([](const auto& m) { return std::array{m.fx, m.fy, m.cx, m.cy}; }, model_);
}

std::vector<double> Camera::distortion() const {
  return std::visit([](const auto& m) { return coefficients(m); }, model_);
}

double Camera::focal_px() const {
  return std::visit(
      [](const auto& m) {
        double scale = 1;
        if constexpr (requires { m.xi; }) scale += m.xi;  // ds and omni-radtan: the axis' point is 1 + xi from the centre
        return 0.5 * (m.fx + m.fy) / scale;
      },
      model_);
}

bool Camera::in_domain(const Vec3& p_lens) const { return std::atan2(p_lens.head<2>().norm(), p_lens.z()) <= widest_rad_; }

Vec2 Camera::distort(const Vec2& normalised, Mat2* J_pixel_normalised) const {
  if (by_rays()) {
    Eigen::Matrix<double, 2, 3> J_pixel_point = Eigen::Matrix<double, 2, 3>::Zero();
    const auto pixel = project_in_lens(R_lens_ * normalised.homogeneous(), &J_pixel_point);
    if (J_pixel_normalised) *J_pixel_normalised = pixel ? Mat2(J_pixel_point * R_lens_.leftCols<2>()) : Mat2(Mat2::Zero());
    return pixel.value_or(Vec2::Constant(std::numeric_limits<double>::quiet_NaN()));
  }
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

std::optional<Vec2> Camera::project_in_lens(const Vec3& p_lens, Eigen::Matrix<double, 2, 3>* J_pixel_point) const {
  if (lens_) return lens_->project(p_lens, J_pixel_point);
  if (!J_pixel_point) return project_point(model_, p_lens);
  LensDerivatives derivatives;
  const auto pixel = project_point(model_, p_lens, &derivatives);
  *J_pixel_point = derivatives.point;
  return pixel;
}

std::optional<Vec3> Camera::ray_in_lens(const Vec2& pixel) const {
  if (lens_) return lens_->ray(pixel);
  return std::visit(
      [&](const auto& m) -> std::optional<Vec3> {
        const Vec2 uv((pixel.x() - m.cx) / m.fx, (pixel.y() - m.cy) / m.fy);
        return std::isfinite(uv.norm()) ? direction_of(m, uv, widest_rad_, max_plane_radius_) : std::nullopt;
      },
      model_);
}

std::optional<Vec3> Camera::ray(const Vec2& pixel) const {
  const auto in_lens = ray_in_lens(pixel);
  if (!in_lens || !in_domain(*in_lens)) return std::nullopt;
  const Vec3 unit = in_lens->normalized();
  return is_turned_ ? Vec3(R_lens_.transpose() * unit) : unit;
}

std::optional<Vec2> Camera::pixel_of(const Vec3& p_C) const {
  const Vec3 p_lens = is_turned_ ? Vec3(R_lens_ * p_C) : p_C;
  if (!(p_lens.squaredNorm() > 1e-18) || !in_domain(p_lens)) return std::nullopt;
  return project_in_lens(p_lens);
}

std::optional<Vec2> Camera::undistort(const Vec2& pixel) const {
  if (by_rays()) {
    const auto direction = ray(pixel);
    if (!direction || !(direction->z() > 0)) return std::nullopt;
    const Vec2 n = direction->hnormalized();
    return n.norm() <= kLargestRadius ? std::optional<Vec2>(n) : std::nullopt;
  }
  return std::visit(
      [&](const auto& m) -> std::optional<Vec2> {
        const Vec2 target((pixel.x() - m.cx) / m.fx, (pixel.y() - m.cy) / m.fy);
        if (!std::isfinite(target.norm())) return std::nullopt;
        if constexpr (requires { undistort_unit(m, target); }) {
          const std::optional<Vec2> n = undistort_unit(m, target);
          return n && n->norm() <= max_radius_ ? n : std::nullopt;
        } else {
          return undistort_by_newton(m, target, max_radius_);
        }
      },
      model_);
}

bool Camera::sees_backwards() const {
  if (lens_ || max_radius_ < kLargestRadius) return false;
  const double right = width_ - 1, bottom = height_ - 1;
  const auto backwards = [&](double u, double v) { return !undistort({u, v}); };
  return (backwards(0, 0.5 * bottom) && backwards(right, 0.5 * bottom)) ||
         (backwards(0.5 * right, 0) && backwards(0.5 * right, bottom));
}

std::optional<Vec2> Camera::project(const Vec3& p_C) const {
  if (!(p_C.z() > 1e-9)) return std::nullopt;
  const Vec2 n(p_C.x() / p_C.z(), p_C.y() / p_C.z());
  if (by_rays() ? !in_domain(R_lens_ * p_C) : !(n.squaredNorm() <= max_radius_ * max_radius_)) return std::nullopt;
  Mat2 J;
  const Vec2 pixel = distort(n, &J);
  // Tangential distortion can fold the plane even within the radial bound.
  if (!(J.determinant() > 0)) return std::nullopt;
  return pixel;
}

}  // namespace fbvins
