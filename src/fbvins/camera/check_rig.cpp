// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/check_rig.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

namespace fbvins {
namespace {

Error malformed(std::string_view origin, const std::string& what) {
  return {ErrorCode::malformed, fmt::format("{}: {}", origin, what)};
}

/// Slower than any shutter that is sold: a unit other than seconds.
constexpr double kLongestLineDelay_s = 1e-3;
/// More than any two drivers differ by: a unit other than seconds, or two clocks.
constexpr double kFarthestApart_s = 0.1;

/// Half way from the principal point to the edge of the image, the angle from the axis is at least this share of what a pinhole
/// has there, and at most this multiple of what an equidistant lens has.
constexpr double kNarrowest = 0.6, kWidest = 1.6;

bool positive(double x) { return x > 0 && std::isfinite(x); }

template <class C>
bool is_transform(const Pose<B, C>& T) {
  return T.p.allFinite() && std::abs(T.q.norm() - 1) < 1e-6;  // nor NaN
}

bool all_finite(const std::vector<double>& numbers) {
  for (const double x : numbers)
    if (!std::isfinite(x)) return false;
  return true;
}

/// What cannot be a lens with an image of this size behind it: mostly the calibration of an image of another size, or a mistyped
/// number. Angles are compared with those near the principal point, so that the model's parameters need not be known.
Result<void> check_lens(const Camera& camera, std::string_view side, std::string_view origin) {
  const double w = camera.width(), h = camera.height();
  const auto [fx, fy, cx, cy] = camera.intrinsics();
  if (cx < w / 3 || cx > 2 * w / 3 || cy < h / 3 || cy > 2 * h / 3)
    return malformed(origin,
                     fmt::format("the {} camera's principal point ({:.0f}, {:.0f}) is outside the middle third of its image of "
                                 "{} x {} pixels: is the calibration of an image of another size?",
                                 side, cx, cy, camera.width(), camera.height()));
  constexpr double kHalfWay = 0.5, kNear = 0.01;  // of the distance to the edge
  for (const Vec2& towards : {Vec2(-cx, 0), Vec2(w - cx, 0), Vec2(0, -cy), Vec2(0, h - cy)}) {
    const auto ray = camera.ray(Vec2(cx, cy) + kHalfWay * towards), near = camera.ray(Vec2(cx, cy) + kNear * towards);
    if (ray && near) {
      const double angle = std::atan2(ray->head<2>().norm(), ray->z());
      const double equidistant = kHalfWay / kNear * near->head<2>().norm() / near->z(), pinhole = std::atan(equidistant);
      if (angle > kNarrowest * pinhole && angle < kWidest * equidistant) continue;
    }
    return malformed(origin, fmt::format("the {} camera's distortion is impossible: half way to the edge of the image it {}",
                                         side, ray ? "bends rays as no lens does" : "has no rays any more"));
  }
  return {};
}

/// `side`: which camera.
Result<void> check_camera(const Camera& camera, std::string_view side, std::string_view origin) {
  if (camera.width() < 1 || camera.height() < 1)
    return malformed(origin, fmt::format("the {} camera has {} x {} pixels", side, camera.width(), camera.height()));
  const auto [fx, fy, cx, cy] = camera.intrinsics();
  if (!positive(fx) || !positive(fy) || !std::isfinite(cx) || !std::isfinite(cy) || !all_finite(camera.distortion()))
    return malformed(origin,
                     fmt::format("the {} camera's focal lengths are not positive, or a number of it is not finite", side));
  if (Result<void> good = check_lens(camera, side, origin); !good) return good;
  const Mask* mask = camera.mask().get();
  if (mask != nullptr && (mask->width() != camera.width() || mask->height() != camera.height()))
    return malformed(origin, fmt::format("the {} camera's mask has {} x {} pixels, its images {} x {}", side, mask->width(),
                                         mask->height(), camera.width(), camera.height()));
  if (mask != nullptr && mask->hides_all(0, 0, mask->width(), mask->height()))
    return malformed(origin, fmt::format("the {} camera's mask hides all of the image", side));
  return {};
}

/// A scale that is farther from 1 than this, or its reciprocal, is another unit or no calibration; a cheap IMU has 3 %, and axes
/// that stand 8 degrees from square change a scale by 15 %.
constexpr double kSmallestScale = 0.75;
/// Half a radian a second at rest: no gyroscope that is sold does that by gravity, or has such a bias.
constexpr double kLargestByForce = 0.05, kLargestGyroBias_radps = 1, kLargestAccelBias_mps2 = 5;

/// By how much the matrix stretches at least and at most.
std::pair<double, double> stretch(const Mat3& m) {
  const Eigen::SelfAdjointEigenSolver<Mat3> squares(m.transpose() * m, Eigen::EigenvaluesOnly);
  return {std::sqrt(std::max(0.0, squares.eigenvalues()(0))), std::sqrt(squares.eigenvalues()(2))};
}

Result<void> check_axes(const ImuIntrinsics& axes, std::string_view origin) {
  for (const auto& [matrix, name] : {std::pair(&axes.gyro, "gyroscope"), {&axes.accel, "accelerometer"}}) {
    if (!matrix->allFinite())
      return malformed(origin, fmt::format("the {}'s scale and axes have a number that is not finite", name));
    const auto [least, most] = stretch(*matrix);
    if (!(least >= kSmallestScale) || !(most <= 1 / kSmallestScale))
      return malformed(origin,
                       fmt::format("the {}'s scale is {:.2f} to {:.2f}, not {} to {:.2f}: no IMU reads so; is the unit another "
                                   "one, or was the calibration not determined?",
                                   name, least, most, kSmallestScale, 1 / kSmallestScale));
    if (!(matrix->determinant() > 0)) return malformed(origin, fmt::format("the {}'s axes are left-handed", name));
  }
  if (!(axes.gyro_by_force.cwiseAbs().maxCoeff() <= kLargestByForce))
    return malformed(origin,
                     fmt::format("the gyroscope's sensitivity to forces is more than {} rad/s for each m/s^2", kLargestByForce));
  if (!(axes.bias.gyro_radps.cwiseAbs().maxCoeff() <= kLargestGyroBias_radps) ||
      !(axes.bias.accel_mps2.cwiseAbs().maxCoeff() <= kLargestAccelBias_mps2))
    return malformed(
        origin, fmt::format("the IMU's bias is more than {} rad/s or {} m/s^2", kLargestGyroBias_radps, kLargestAccelBias_mps2));
  return {};
}

}  // namespace

Result<void> check_imu(const ImuNoise& noise, std::string_view origin) {
  for (const auto& [figure, name] : {std::pair(noise.gyro_noise_density_radps_rthz, "gyroscope's noise density"),
                                     {noise.accel_noise_density_mps2_rthz, "accelerometer's noise density"},
                                     {noise.gyro_random_walk_radps2_rthz, "gyroscope's random walk"},
                                     {noise.accel_random_walk_mps3_rthz, "accelerometer's random walk"},
                                     {noise.rate_hz, "IMU's rate"}})
    if (!positive(figure)) return malformed(origin, fmt::format("the {} is {}, not positive", name, figure));
  return check_axes(noise.axes, origin);
}

namespace {

Result<void> check_depth(const StereoRig& rig, std::string_view origin) {
  const DepthSensor& sensor = *rig.depth;
  if (rig.has_right()) return malformed(origin, "a depth sensor goes with one camera, and there are more");
  if (!positive(sensor.noise_at_1m_m) || !positive(sensor.nearest_m) || !positive(sensor.scale_sigma) ||
      !(sensor.farthest_m > sensor.nearest_m) || !std::isfinite(sensor.farthest_m))
    return malformed(origin, "the depth sensor's noise, range or scale is not positive, or its range is empty");
  if (!sensor.own) return {};
  if (Result<void> good = check_camera(sensor.own->camera, "depth", origin); !good) return good;
  if (!is_transform(sensor.own->T_BC)) return malformed(origin, "the pose of the depth sensor is none");
  constexpr double kFarthest_m = 1;
  const double apart_m = (sensor.own->T_BC.p - rig.T_BC0().p).norm();
  if (!(apart_m < kFarthest_m))
    return malformed(origin, fmt::format("the depth sensor is {:.3g} m from the camera, more than {} m", apart_m, kFarthest_m));
  return {};
}

Result<void> check_times(const StereoRig& rig, std::string_view origin) {
  for (int i = 0; i < rig.camera_count(); ++i) {
    const std::string whose = rig.camera(i).own_times() == CameraTimes{} ? std::string() : fmt::format(" of camera {}", i);
    const auto [time_offset_s, line_delay_s] = rig.times(i);
    if (!(std::abs(line_delay_s) <= kLongestLineDelay_s))
      return malformed(origin,
                       fmt::format("the line delay{} is {} s, more than {} s a row", whose, line_delay_s, kLongestLineDelay_s));
    if (!(std::abs(time_offset_s - rig.time_offset_s) <= kFarthestApart_s))
      return malformed(origin, fmt::format("the time offset{} differs from camera 0's by {:.1f} ms, more than {:.0f} ms", whose,
                                           1e3 * (time_offset_s - rig.time_offset_s), 1e3 * kFarthestApart_s));
  }
  return {};
}

}  // namespace

Result<void> check_rig(const StereoRig& rig, std::string_view origin) {
  if (rig.cameras.empty()) return malformed(origin, "there is no camera");
  if (rig.camera_count() > kMostCameras)
    return malformed(origin, fmt::format("there are {} cameras, more than {}", rig.camera_count(), kMostCameras));
  for (int i = 0; i < rig.camera_count(); ++i) {
    const std::string side = i == 0 ? "left" : i == 1 ? "right" : fmt::format("number {}", i);
    if (Result<void> good = check_camera(rig.camera(i), side, origin); !good) return good;
    if (!is_transform(rig.T_BC(i)))
      return malformed(origin, "a camera's pose in the body has a number that is not finite, or no rotation");
  }
  const double baseline_m = rig.T_C1C0().p.norm();
  if (rig.has_right() && !(baseline_m > 1e-3 && baseline_m < 10.0))
    return malformed(origin, fmt::format("the two cameras are {:.3g} m apart, not between 1 mm and 10 m", baseline_m));
  if (rig.depth)
    if (Result<void> good = check_depth(rig, origin); !good) return good;
  if (!positive(rig.image_rate_hz) || !std::isfinite(rig.time_offset_s))
    return malformed(origin, "the images' rate is not positive, or the time offset is not finite");
  if (Result<void> good = check_times(rig, origin); !good) return good;
  return check_imu(rig.imu_noise, origin);
}

}  // namespace fbvins
