// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/spoilers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "fbvins/core/rng.hpp"
#include "fbvins/doctor/lens_change.hpp"

namespace fbvins {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kTenth = 0.1;  // tolerance of sizes
constexpr double kTimeTolerance_ms = 1, kRotationTolerance_deg = 0.5;

Mat3 axes(int x, int y, int z) {
  Mat3 P = Mat3::Zero();
  int row = 0;
  for (const int axis : {x, y, z}) P(row++, std::abs(axis) - 1) = axis > 0 ? 1 : -1;
  return P;
}

Mat3 turn(const Vec3& axis, double degrees) { return so3_exp(degrees / kDegrees * axis).toRotationMatrix(); }

Spoiler gyro(std::string name, FindingKind kind, double size, double tolerance, const Mat3& by) {
  return {std::move(name), kind, size, tolerance, {}, [by](ImuSample& s) { s.gyro_radps = by * s.gyro_radps; }, {}};
}
Spoiler accel(std::string name, FindingKind kind, double size, double tolerance, const Mat3& by) {
  return {std::move(name), kind, size, tolerance, {}, [by](ImuSample& s) { s.accel_mps2 = by * s.accel_mps2; }, {}};
}
Spoiler imu_turned(std::string name, const Mat3& by) {
  const double angle = kDegrees * so3_log(Quat(by)).norm();
  return {std::move(name),
          FindingKind::imu_camera_rotation,
          angle,
          kRotationTolerance_deg,
          {},
          [by](ImuSample& s) { s.gyro_radps = by * s.gyro_radps, s.accel_mps2 = by * s.accel_mps2; },
          {}};
}
Spoiler calibration_turned(std::string name, const Vec3& axis, double degrees) {
  return {std::move(name),
          FindingKind::imu_camera_rotation,
          degrees,
          kRotationTolerance_deg,
          [axis, degrees](StereoRig& rig) {
            const auto T_C0C1 = rig.T_BC0.inverse() * rig.T_BC1;
            rig.T_BC0 = {Mat3(turn(axis, degrees) * rig.T_BC0.R()), rig.T_BC0.p};
            rig.T_BC1 = rig.T_BC0 * T_C0C1;
          },
          {},
          {}};
}
Spoiler readings_late(double ms) {
  return {fmt::format("readings stamped {:+.0f} ms", ms),
          FindingKind::time_offset,
          ms,
          kTimeTolerance_ms,
          {},
          [ms](ImuSample& s) { s.t = s.t + Duration::from_seconds(1e-3 * ms); },
          {}};
}
Spoiler right_turned(std::string name, const Vec3& axis, double degrees) {
  return {std::move(name),
          FindingKind::right_camera_turned,
          degrees,
          std::max(kTenth * degrees, 0.05),
          [axis, degrees](StereoRig& rig) {
            rig.T_BC1 = {Mat3(rig.T_BC1.R() * turn(axis, degrees)), rig.T_BC1.p};
          },
          {},
          {}};
}
Spoiler focal(std::string name, bool left, bool right, double factor) {
  const double percent = 100 * (factor - 1);
  return {std::move(name),
          FindingKind::focal_length,
          percent,
          kTenth * std::abs(percent),
          [=](StereoRig& rig) {
            if (left) rig.left = changed(rig.left, {.log_focal = std::log(factor)});
            if (right) rig.right = changed(rig.right, {.log_focal = std::log(factor)});
          },
          {},
          {}};
}
Spoiler baseline(std::string name, double factor, const StereoRig& rig) {
  const double wrong_mm = 1e3 * rig.T_C1C0().p.norm() * (factor - 1);
  return {std::move(name),
          FindingKind::baseline_length,
          wrong_mm,
          kTenth * std::abs(wrong_mm),
          [factor](StereoRig& r) { r.T_BC1.p = r.T_BC0.p + factor * (r.T_BC1.p - r.T_BC0.p); },
          {},
          {}};
}
void forget_distortion(Camera& camera) {
  auto model = camera.model();
  std::visit([](auto& m) { m = {m.fx, m.fy, m.cx, m.cy}; }, model);
  camera = camera.with_lens(model);
}

/// Each `nth` image is the one before.
Spoiler frozen(std::string name, int nth, bool left, bool right) {
  struct State {
    StereoFrame before;
    int count = 0;
  };
  auto state = std::make_shared<State>();
  return {std::move(name), FindingKind::frozen_images, 0, 0, {}, {}, [=](StereoFrame& frame) {
            if (++state->count % nth == 0) {
              if (left) frame.left = state->before.left;
              if (right) frame.right = state->before.right;
            }
            state->before = frame;
          }};
}

Spoiler right_one_frame_late(double period_s) {
  auto before = std::make_shared<std::shared_ptr<const Image>>();
  return {"right images one frame old",
          FindingKind::stereo_sync,
          -1e3 * period_s,
          std::max(kTenth * 1e3 * period_s, kTimeTolerance_ms),
          {},
          {},
          [before](StereoFrame& frame) {
            if (!*before) *before = frame.right;
            std::swap(*before, frame.right);
          }};
}

std::shared_ptr<const Image> with(const std::shared_ptr<const Image>& image, const std::function<void(Image&)>& change) {
  if (!image) return image;
  auto copy = std::make_shared<Image>(image->width(), image->height());
  for (int y = 0; y < image->height(); ++y) std::copy(image->row(y), image->row(y) + image->width(), copy->row(y));
  change(*copy);
  return copy;
}

void add_dot(Image& image, double x, double y, double brightness) {
  for (int py = static_cast<int>(y) - 3; py <= static_cast<int>(y) + 4; ++py)
    for (int px = static_cast<int>(x) - 3; px <= static_cast<int>(x) + 4; ++px) {
      if (px < 0 || py < 0 || px >= image.width() || py >= image.height()) continue;
      const double light = brightness * std::exp(-0.5 * ((px - x) * (px - x) + (py - y) * (py - y)));
      image.at(px, py) = static_cast<std::uint8_t>(std::min(255.0, image.at(px, py) + light));
    }
}

/// A projector beside the cameras: a pattern that moves with them.
Spoiler dots(const StereoRig& rig) {
  std::vector<Vec2> places;
  Rng rng(5);
  for (int y = 8; y < rig.left.height() - 8; y += 18)
    for (int x = 8; x < rig.left.width() - 8; x += 18) {
      const double dx = rng.uniform(), dy = rng.uniform();
      places.emplace_back(x + 8 * dx, y + 8 * dy);
    }
  return {"projector of dots on", FindingKind::projector_dots, 0, 0, {}, {}, [places](StereoFrame& frame) {
            frame.left = with(frame.left, [&](Image& image) {
              for (const Vec2& p : places) add_dot(image, p.x(), p.y(), 110);
            });
            frame.right = with(frame.right, [&](Image& image) {
              for (const Vec2& p : places) add_dot(image, p.x() - 9, p.y(), 110);
            });
          }};
}

/// A part of the vehicle in the lower third of both images.
Spoiler vehicle_in_view() {
  return {"vehicle in view", FindingKind::fixed_in_view, 0, 0, {}, {}, [](StereoFrame& frame) {
            const auto paint = [](Image& image) {
              Rng rng(9);
              for (int y = 2 * image.height() / 3; y < image.height(); y += 12)
                for (int x = 0; x < image.width(); x += 12) {
                  const auto grey = static_cast<std::uint8_t>(40 + 150 * rng.uniform());
                  for (int v = y; v < std::min(y + 12, image.height()); ++v)
                    for (int u = x; u < std::min(x + 12, image.width()); ++u) image.at(u, v) = grey;
                }
            };
            frame.left = with(frame.left, paint);
            frame.right = with(frame.right, paint);
          }};
}

/// Derivative of the image velocity by the angular rate, on a grid of kFlowGrid_px, px/s per rad/s.
constexpr int kFlowGrid_px = 16;
std::vector<Eigen::Matrix<double, 2, 3>> flow_of(const Camera& camera) {
  std::vector<Eigen::Matrix<double, 2, 3>> flow;
  for (int y = kFlowGrid_px / 2; y < camera.height() + kFlowGrid_px; y += kFlowGrid_px)
    for (int x = kFlowGrid_px / 2; x < camera.width() + kFlowGrid_px; x += kFlowGrid_px) {
      flow.emplace_back(Eigen::Matrix<double, 2, 3>::Zero());
      const auto ray = camera.undistort(Vec2(x, y));
      if (!ray) continue;
      for (int i = 0; i < 3; ++i) {
        const Vec3 turned = ray->homogeneous() - 1e-4 * Vec3::Unit(i).cross(ray->homogeneous());
        flow.back().col(i) = 1e4 * (camera.distort(turned.hnormalized()) - Vec2(x, y));
      }
    }
  return flow;
}

/// Motion blur: each pixel becomes the mean along its path under the camera's rotation `turn_C`, rad, during the exposure.
void smear(Image& image, const std::vector<Eigen::Matrix<double, 2, 3>>& flow, const Vec3& turn_C) {
  const Image sharp = image;
  const int columns = (image.width() + kFlowGrid_px + kFlowGrid_px / 2 - 1) / kFlowGrid_px;
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      const Vec2 way = flow[static_cast<std::size_t>(y / kFlowGrid_px * columns + x / kFlowGrid_px)] * turn_C;
      const int steps = std::clamp(static_cast<int>(std::ceil(way.norm())), 1, 60);
      int sum = 0;
      for (int i = 0; i <= steps; ++i) {
        const Vec2 at = Vec2(x, y) + (static_cast<double>(i) / steps - 0.5) * way;
        sum += sharp.at(std::clamp(static_cast<int>(std::lround(at.x())), 0, image.width() - 1),
                        std::clamp(static_cast<int>(std::lround(at.y())), 0, image.height() - 1));
      }
      image.at(x, y) = static_cast<std::uint8_t>(sum / (steps + 1));
    }
}

/// Blur by the rate of the newest reading before an image.
Spoiler exposed_longer(const StereoRig& rig, double ms) {
  auto rate_B = std::make_shared<Vec3>(Vec3::Zero());
  return {fmt::format("exposed for {:.0f} ms longer", ms),
          FindingKind::blur,
          0,
          0,
          {},
          [rate_B](ImuSample& sample) { *rate_B = sample.gyro_radps; },
          [=, left = flow_of(rig.left), right = flow_of(rig.right)](StereoFrame& frame) {
            const Vec3 turn_B = 1e-3 * ms * *rate_B;
            frame.left = with(frame.left, [&](Image& image) { smear(image, left, rig.T_BC0.R().transpose() * turn_B); });
            frame.right = with(frame.right, [&](Image& image) { smear(image, right, rig.T_BC1.R().transpose() * turn_B); });
          }};
}

/// Readings saturate at +-`range`, rad/s.
Spoiler clipped_gyro(double range) {
  return {fmt::format("gyroscope of {:.1f} rad/s", range),
          FindingKind::saturation,
          0,
          0,
          {},
          [range](ImuSample& s) { s.gyro_radps = s.gyro_radps.cwiseMax(-range).cwiseMin(range); },
          {}};
}

std::vector<Spoiler> of_the_imu() {
  const Mat3 one = Mat3::Identity();
  std::vector<Spoiler> all{
      gyro("gyroscope in degrees", FindingKind::gyro_units, kDegrees, kTenth * kDegrees, kDegrees * one),
      gyro("gyroscope converted twice", FindingKind::gyro_units, 1 / kDegrees, kTenth / kDegrees, one / kDegrees),
      gyro("gyroscope's scale 8 % too large", FindingKind::gyro_scale, 8, 0.8, 1.08 * one),
      accel("accelerometer in g", FindingKind::accel_units, 1 / 9.80665, kTenth / 9.80665, one / 9.80665),
      accel("accelerometer in thousandths of g", FindingKind::accel_units, 1000 / 9.80665, 100 / 9.80665, 1000 / 9.80665 * one),
      accel("accelerometer in mm/s^2", FindingKind::accel_units, 1000, 100, 1000 * one),
      gyro("gyroscope: x with the wrong sign", FindingKind::gyro_axes, 0, 0, axes(-1, 2, 3)),
      gyro("gyroscope: y with the wrong sign", FindingKind::gyro_axes, 0, 0, axes(1, -2, 3)),
      gyro("gyroscope: x and z exchanged", FindingKind::gyro_axes, 0, 0, axes(3, 2, 1)),
      gyro("gyroscope: all signs wrong", FindingKind::gyro_axes, 0, 0, axes(-1, -2, -3)),
      gyro("gyroscope: axes (y, z, x)", FindingKind::gyro_axes, 0, 0, axes(2, 3, 1)),
      accel("accelerometer: y with the wrong sign", FindingKind::accel_axes, 0, 0, axes(1, -2, 3)),
      accel("accelerometer: all signs wrong", FindingKind::accel_axes, 0, 0, axes(-1, -2, -3)),
      accel("accelerometer: x and z exchanged", FindingKind::accel_axes, 0, 0, axes(3, 2, 1)),
      imu_turned("IMU mounted the other way round", axes(-1, -2, 3)),
      imu_turned("IMU upside down", axes(1, -2, -3)),
      imu_turned("IMU turned by a quarter", axes(2, -1, 3)),
      imu_turned("IMU in FRD instead of FLU, by 30 degrees", Mat3(turn(Vec3::UnitY(), 30) * axes(1, -2, -3))),
      readings_late(100),
      readings_late(-20),
      readings_late(6),
      readings_late(850),
      clipped_gyro(0.6),
  };
  all.push_back({"vibration of 12 m/s^2 at 83 Hz",
                 FindingKind::vibration,
                 0,
                 0,
                 {},
                 [](ImuSample& s) {
                   s.accel_mps2.z() +=
                       12 * std::numbers::sqrt2 * std::sin(2 * std::numbers::pi * 83 * (s.t.ns % 1'000'000'000'000) * 1e-9);
                 },
                 {}});
  auto held = std::make_shared<std::pair<int, ImuSample>>();
  all.push_back({"each reading given twice",
                 FindingKind::imu_stamps,
                 0,
                 0,
                 {},
                 [held](ImuSample& s) {
                   if (held->first++ % 2 == 0) held->second = s;
                   else s.gyro_radps = held->second.gyro_radps, s.accel_mps2 = held->second.accel_mps2;
                 },
                 {}});
  all.push_back({"readings stamped since power-on",
                 FindingKind::clocks_apart,
                 0,
                 0,
                 {},
                 [](ImuSample& s) { s.t = s.t - Duration{1'000'000'000'000'000}; },
                 {}});
  return all;
}

std::vector<Spoiler> of_the_calibration(const StereoRig& rig) {
  return {
      calibration_turned("mounting wrong by 5 degrees about y", Vec3::UnitY(), 5),
      calibration_turned("mounting wrong by 2 degrees about z", Vec3::UnitZ(), 2),
      calibration_turned("mounting wrong by 90 degrees about x", Vec3::UnitX(), 90),
      right_turned("right camera turned 1 degree about x", Vec3::UnitX(), 1),
      right_turned("right camera turned 1.5 degrees about z", Vec3::UnitZ(), 1.5),
      focal("left focal length 5 % too long", true, false, 1.05),
      focal("right focal length 4 % too short", false, true, 0.96),
      focal("both focal lengths 8 % too long", true, true, 1.08),
      {"right principal point off by (20, 12)",
       FindingKind::principal_point,
       std::hypot(20, 12),
       0.1 * std::hypot(20, 12),
       [](StereoRig& r) {
         r.right = changed(r.right, {.centre_px = {20, 12}});
       },
       {},
       {}},
      {"left lens without distortion", FindingKind::distortion, 0, 0, [](StereoRig& r) { forget_distortion(r.left); }, {}, {}},
      {"both lenses without distortion",
       FindingKind::distortion,
       0,
       0,
       [](StereoRig& r) { forget_distortion(r.left), forget_distortion(r.right); },
       {},
       {}},
      {"right lens without distortion", FindingKind::distortion, 0, 0, [](StereoRig& r) { forget_distortion(r.right); }, {}, {}},
      baseline("baseline 9 % too short", 0.91, rig),
      baseline("baseline 10 % too long", 1.10, rig),
      baseline("baseline twice as long", 2, rig),
      {"rate of the IMU twice as high", FindingKind::imu_stamps, 0, 0, [](StereoRig& r) { r.imu_noise.rate_hz *= 2; }, {}, {}},
  };
}

std::vector<Spoiler> of_the_images(const StereoRig& rig) {
  std::vector<Spoiler> all;
  all.push_back({"left and right exchanged", FindingKind::swapped_images, 0, 0, {}, {}, [](StereoFrame& f) {
                   std::swap(f.left, f.right);
                 }});
  all.push_back({"one camera as both", FindingKind::same_image_twice, 0, 0, {}, {}, [](StereoFrame& f) { f.right = f.left; }});
  all.push_back(frozen("one right image in ten frozen", 10, false, true));
  all.push_back(frozen("every image twice", 2, true, true));
  all.push_back(right_one_frame_late(1 / rig.image_rate_hz));
  all.push_back(
      {"images stamped on arrival", FindingKind::image_stamps, 0, 0, {}, {}, [rng = std::make_shared<Rng>(3)](StereoFrame& f) {
         f.t = f.t + Duration::from_seconds(0.02 * rng->uniform());
       }});
  all.push_back(dots(rig));
  all.push_back(vehicle_in_view());
  all.push_back(exposed_longer(rig, 30));
  return all;
}

}  // namespace

std::vector<Spoiler> spoilers(const StereoRig& rig) {
  std::vector<Spoiler> all = of_the_imu();
  for (Spoiler& spoiler : of_the_calibration(rig)) all.push_back(std::move(spoiler));
  for (Spoiler& spoiler : of_the_images(rig)) all.push_back(std::move(spoiler));
  return all;
}

}  // namespace fbvins
