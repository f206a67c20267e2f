// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/depth_reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "fbvins/core/hypotenuse.hpp"
#include "fbvins/geometry/ldlt.hpp"

namespace fbvins {
namespace {

/// Half of the side of the window, and how many of its pixels need a depth.
constexpr int kRadius_px = 2;
constexpr int kFewest = 18;
/// An edge of depth passes where a depth of the window is off the plane by so many sigmas of the sensor.
constexpr double kEdge_sigma = 4;
/// Depths are whole millimetres.
constexpr double kRounding_m = 0.0005;

/// Inverse depths of a window, and where they are from the pixel.
class Samples {
 public:
  void add(const Vec2& off_px, double rho) {
    Sample& s = samples_[count_++] = {Vec3(1, off_px.x(), off_px.y()), rho};
    H_ += s.at * s.at.transpose();
    g_ += s.rho * s.at;
  }
  /// The plane through them: value at the pixel and slopes; nullopt where they are too few.
  std::optional<Vec3> plane() const { return count_ < kFewest ? std::nullopt : std::optional<Vec3>(Ldlt<3>(H_).solve(g_)); }
  /// With the sensor's own `sigma`; nothing where one of them is off the plane.
  std::optional<MeasuredInverseDepth> on(const Vec3& plane, double sigma) const {
    double squares = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const double off = samples_[i].rho - plane.dot(samples_[i].at);
      if (!(std::abs(off) < kEdge_sigma * sigma)) return std::nullopt;
      squares += off * off;
    }
    return MeasuredInverseDepth{plane[0], std::sqrt(sigma * sigma + squares / static_cast<double>(count_)), plane.tail<2>()};
  }

 private:
  struct Sample {
    Vec3 at;
    double rho;
  };
  std::array<Sample, (2 * kRadius_px + 1) * (2 * kRadius_px + 1)> samples_;
  std::size_t count_ = 0;
  Mat3 H_ = Mat3::Zero();
  Vec3 g_ = Vec3::Zero();
};

/// The middle of the window around a pixel; nullopt where that is not all in an image of this size.
std::optional<std::array<int, 2>> middle(const Vec2& px, int width, int height) {
  if (!(px.cwiseAbs().maxCoeff() < 1e6)) return std::nullopt;
  const int x = static_cast<int>(std::lround(px.x())), y = static_cast<int>(std::lround(px.y()));
  if (x < kRadius_px || y < kRadius_px || x + kRadius_px >= width || y + kRadius_px >= height) return std::nullopt;
  return std::array{x, y};
}

std::optional<double> depth_m(const DepthSensor& sensor, const DepthImage& image, int x, int y) {
  const double depth_m = 1e-3 * image.row(y)[x];
  return depth_m < sensor.nearest_m || depth_m > sensor.farthest_m ? std::nullopt : std::optional(depth_m);
}

double sigma_of(const DepthSensor& sensor, double rho) { return hypotenuse(sensor.noise_at_1m_m, kRounding_m * rho * rho); }

/// A plane through the depths of a window.
struct Fit {
  Samples samples;
  Vec3 plane;
};

/// What a sensor that lies elsewhere sees of the ray of a pixel: of its point at the inverse depth rho, along the left camera's
/// z, the direction in the sensor's frame E; the direction's z times 1 / rho is its depth there.
class RayElsewhere {
 public:
  RayElsewhere(const DepthSensor& sensor, const Camera& left, const Pose<C0, C0>& T_EC, const Vec2& px, const Vec2& normalised)
      : sensor_(sensor), own_(sensor.own->camera), left_(left), T_EC_(T_EC), px_(px), far_(T_EC.q * normalised.homogeneous()) {}

  Vec3 direction(double rho) const { return far_ + rho * T_EC_.p; }
  std::optional<Vec2> pixel(double rho) const { return own_.project(direction(rho)); }

  /// The inverse depth at which the ray first meets a measured surface, to a pixel; from near to far, so that what is behind
  /// something nearer is not taken. In holes it goes on.
  std::optional<double> first_surface(const DepthImage& image) const {
    constexpr double kMostSteps = 2000;
    const double nearest = 1 / sensor_.nearest_m;
    const auto from = pixel(nearest), to = pixel(0);
    const double length_px = from && to ? (*from - *to).norm() : own_.width();
    const int steps = 1 + static_cast<int>(std::min(std::ceil(length_px), kMostSteps));
    for (int i = 0; i <= steps; ++i) {
      const double rho = nearest * (steps - i) / steps;
      const auto px = pixel(rho);
      const auto around = px ? middle(*px, image.width, image.height) : std::nullopt;
      const auto measured = around ? depth_m(sensor_, image, (*around)[0], (*around)[1]) : std::nullopt;
      if (measured && *measured * rho <= direction(rho).z()) return direction(rho).z() / *measured;
    }
    return std::nullopt;
  }

  /// Through the depths around a pixel of the sensor's, in the left camera's pixels around its own.
  std::optional<Fit> fit(const DepthImage& image, const Vec2& around) const {
    const auto at = middle(around, image.width, image.height);
    if (!at) return std::nullopt;
    const auto [x0, y0] = *at;
    const Pose<C0, C0> T_CE = T_EC_.inverse();
    Fit out;
    for (int y = y0 - kRadius_px; y <= y0 + kRadius_px; ++y)
      for (int x = x0 - kRadius_px; x <= x0 + kRadius_px; ++x) {
        const auto depth = depth_m(sensor_, image, x, y);
        const auto normalised = depth ? own_.undistort(Vec2(x, y)) : std::nullopt;
        if (!normalised) continue;
        const Vec3 p_C = T_CE * Vec3(*depth * normalised->homogeneous());
        if (const auto seen = left_.project(p_C)) out.samples.add(*seen - px_, 1 / p_C.z());
      }
    const auto plane = out.samples.plane();
    if (!plane) return std::nullopt;
    out.plane = *plane;
    return out;
  }

  /// Its noise is that of the inverse depth along the sensor's own z.
  double sigma(double rho) const {
    const Vec3 d = direction(rho) / direction(rho).z();
    const double own_rho = rho / direction(rho).z(), z_per_own_z = (T_EC_.q.conjugate() * d).z();
    return sigma_of(sensor_, own_rho) * z_per_own_z * rho * rho / (own_rho * own_rho);
  }

 private:
  const DepthSensor& sensor_;
  const Camera &own_, &left_;
  const Pose<C0, C0>& T_EC_;
  Vec2 px_;
  Vec3 far_;
};

/// The window is around where the ray meets the plane that is fitted to it.
std::optional<MeasuredInverseDepth> measure(const RayElsewhere& ray, const DepthImage& image) {
  constexpr int kMostFits = 4;
  const auto first = ray.first_surface(image);
  auto around = first ? ray.pixel(*first) : std::nullopt;
  for (int i = 0; i < kMostFits && around; ++i) {
    const auto fit = ray.fit(image, *around);
    const double rho = fit ? fit->plane[0] : 0;
    const auto met = rho > 0 ? ray.pixel(rho) : std::nullopt;
    if (!met) return std::nullopt;
    if ((*met - *around).cwiseAbs().maxCoeff() <= 1) return fit->samples.on(fit->plane, ray.sigma(rho));
    around = met;
  }
  return std::nullopt;
}

}  // namespace

DepthReader::DepthReader(const StereoRig& rig)
    : sensor_(*rig.depth), left_(rig.left()), width_(rig.depth_camera().width()), height_(rig.depth_camera().height()) {
  if (sensor_.own) T_EC_ = sensor_.own->T_BC.inverse() * rig.T_BC0();
}

std::optional<MeasuredInverseDepth> DepthReader::at(const DepthImage& image, const Vec2& px) const {
  if (sensor_.own) {
    const auto normalised = left_.undistort(px);
    return normalised ? measure(RayElsewhere(sensor_, left_, T_EC_, px, *normalised), image) : std::nullopt;
  }
  const auto around = middle(px, width_, height_);
  if (!around) return std::nullopt;
  const auto [x0, y0] = *around;
  Samples samples;
  for (int y = y0 - kRadius_px; y <= y0 + kRadius_px; ++y)
    for (int x = x0 - kRadius_px; x <= x0 + kRadius_px; ++x)
      if (const auto depth = depth_m(sensor_, image, x, y)) samples.add(Vec2(x - px.x(), y - px.y()), 1 / *depth);
  const auto plane = samples.plane();
  return plane ? samples.on(*plane, sigma_of(sensor_, (*plane)[0])) : std::nullopt;
}

}  // namespace fbvins
