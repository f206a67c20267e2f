// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <deque>
#include <memory>
#include <numbers>

#include "fbvins/core/angle.hpp"
#include "tests/support/setup_fault_lists.hpp"

namespace fbvins::setup_fault {
namespace {

Mat3 axes(int x, int y, int z) {
  Mat3 P = Mat3::Zero();
  int row = 0;
  for (const int axis : {x, y, z}) P(row++, std::abs(axis) - 1) = axis > 0 ? 1 : -1;
  return P;
}

SetupFault gyro(std::string name, FindingKind kind, double size, double tolerance, const Mat3& by) {
  return {std::move(name), kind, size, tolerance, {}, [by](ImuSample& s) { s.gyro_radps = by * s.gyro_radps; }, {}};
}
SetupFault accel(std::string name, FindingKind kind, double size, double tolerance, const Mat3& by) {
  return {std::move(name), kind, size, tolerance, {}, [by](ImuSample& s) { s.accel_mps2 = by * s.accel_mps2; }, {}};
}
SetupFault imu_turned(std::string name, const Mat3& by) {
  const double angle = kDegreesPerRad * so3_log(Quat(by)).norm();
  return {std::move(name),
          FindingKind::imu_camera_rotation,
          angle,
          kRotationTolerance_deg,
          {},
          [by](ImuSample& s) { s.gyro_radps = by * s.gyro_radps, s.accel_mps2 = by * s.accel_mps2; },
          {}};
}
SetupFault readings_late(double ms) {
  return {fmt::format("readings stamped {:+.0f} ms", ms),
          FindingKind::time_offset,
          ms,
          kTimeTolerance_ms,
          {},
          [ms](ImuSample& s) { s.t = s.t + Duration::from_seconds(1e-3 * ms); },
          {}};
}
/// The accelerometer's readings come `late` readings after the gyroscope's.
SetupFault accel_late(std::size_t late, double ms) {
  auto before = std::make_shared<std::deque<Vec3>>();
  return {fmt::format("accelerometer {:.0f} ms late", ms),
          FindingKind::accel_late,
          ms,
          10,
          {},
          [before, late](ImuSample& s) {
            before->push_back(s.accel_mps2);
            if (before->size() > late + 1) before->pop_front();
            s.accel_mps2 = before->front();
          },
          {}};
}
SetupFault offset_by(std::string name, FindingKind kind, double size, double tolerance, const Vec3& gyro, const Vec3& accel) {
  return {std::move(name), kind, size, tolerance, {}, [=](ImuSample& s) { s.gyro_radps += gyro, s.accel_mps2 += accel; }, {}};
}

/// Readings saturate at +-`range`, rad/s.
SetupFault clipped_gyro(double range) {
  return {fmt::format("gyroscope of {:.1f} rad/s", range),
          FindingKind::saturation,
          0,
          0,
          {},
          [range](ImuSample& s) { s.gyro_radps = s.gyro_radps.cwiseMax(-range).cwiseMin(range); },
          {}};
}

SetupFault vibration() {
  return {"vibration of 12 m/s^2 at 83 Hz",
          FindingKind::vibration,
          0,
          0,
          {},
          [](ImuSample& s) {
            s.accel_mps2.z() +=
                12 * std::numbers::sqrt2 * std::sin(2 * std::numbers::pi * 83 * (s.t.ns % 1'000'000'000'000) * 1e-9);
          },
          {}};
}

SetupFault each_given_twice() {
  auto held = std::make_shared<std::pair<int, ImuSample>>();
  return {"each reading given twice",
          FindingKind::imu_stamps,
          0,
          0,
          {},
          [held](ImuSample& s) {
            if (held->first++ % 2 == 0) held->second = s;
            else s.gyro_radps = held->second.gyro_radps, s.accel_mps2 = held->second.accel_mps2;
          },
          {}};
}

SetupFault stamped_since_power_on() {
  return {"readings stamped since power-on",
          FindingKind::clocks_apart,
          0,
          0,
          {},
          [](ImuSample& s) { s.t = s.t - Duration{1'000'000'000'000'000}; },
          {}};
}

}  // namespace

std::vector<SetupFault> of_the_imu() {
  const Mat3 one = Mat3::Identity();
  return {
      gyro("gyroscope in degrees", FindingKind::gyro_units, kDegreesPerRad, kTenth * kDegreesPerRad, kDegreesPerRad * one),
      gyro("gyroscope converted twice", FindingKind::gyro_units, 1 / kDegreesPerRad, kTenth / kDegreesPerRad,
           one / kDegreesPerRad),
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
      accel("accelerometer's scale 5 % too large", FindingKind::accel_scale, 5, 1.5, 1.05 * one),
      accel("accelerometer's scale 7 % too small", FindingKind::accel_scale, -7, 1.5, 0.93 * one),
      gyro("gyroscope: z 15 % too large", FindingKind::gyro_scale, 15, 1.5, Vec3(1, 1, 1.15).asDiagonal()),
      offset_by("gyroscope's bias 0.3 rad/s", FindingKind::gyro_bias, 0.3, 0.06, Vec3(0.2, -0.2, 0.1), Vec3::Zero()),
      offset_by("accelerometer's bias 1.5 m/s^2", FindingKind::accel_bias, 1.5, 0.5, Vec3::Zero(), Vec3(1, -1, 0.5)),
      accel_late(8, 40),
      vibration(),
      each_given_twice(),
      stamped_since_power_on(),
  };
}

}  // namespace fbvins::setup_fault
