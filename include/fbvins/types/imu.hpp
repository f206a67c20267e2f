// SPDX-License-Identifier: Apache-2.0
// Readings of an IMU in the body frame B, their noise and biases. SI units; times are on the images' clock where a type says so.
#pragma once

#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {

/// One reading of the IMU, in B.
struct ImuSample {
  Time t;
  Vec3 gyro_radps = Vec3::Zero();  ///< angular rate, rad/s
  Vec3 accel_mps2 = Vec3::Zero();  ///< specific force (at rest: g, upwards), m/s^2
};

/// Factors on an IMU's noise densities, 1 or more, where readings are worse than usual: strong vibration, a clipped axis, or
/// images that contradict them.
struct ImuNoiseScale {
  double gyro = 1, accel = 1;
};

/// The readings between two images, on the images' clock: first.t and last.t are the two image stamps (interpolated),
/// those between are the sensor's own. Empty for the first image and where the IMU is missing. Where the time offset was
/// corrected since the image before, first.t is where that image was taken, by the correction.
struct ImuSegment {
  std::vector<ImuSample> samples;
  Duration longest_gap;  ///< longest time between neighbouring readings that overlaps the segment, its whole length
  ImuNoiseScale noise = {};
  Duration time_offset = {};  ///< with which it was cut: t_imu = t_image + this

  bool empty() const { return samples.size() < 2; }
};

struct ImuBias {
  Vec3 gyro_radps = Vec3::Zero();
  Vec3 accel_mps2 = Vec3::Zero();
};

/// Scale and axes of an IMU: what it reads of an angular rate w and a specific force f, both in B,
///   gyroscope = gyro * w + gyro_by_force * f + bias.gyro_radps,  accelerometer = accel * f + bias.accel_mps2.
/// `bias` is the calibration's, constant; what is left of it, and moves, is estimated in flight.
struct ImuIntrinsics {
  Mat3 gyro = Mat3::Identity(), accel = Mat3::Identity();
  Mat3 gyro_by_force = Mat3::Zero();  ///< rad/s of a gyroscope for each m/s^2 ("g-sensitivity")
  ImuBias bias = {};
  bool operator==(const ImuIntrinsics& o) const;
};

/// What the reading means, by this calibration of its axes; the same bits where that says nothing.
ImuSample corrected(const ImuSample& reading, const ImuIntrinsics& axes);

/// The axes of an IMU whose readings, corrected by `given`, still read by `found`.
ImuIntrinsics followed_by(const ImuIntrinsics& given, const ImuIntrinsics& found);

/// An IMU as in calibration files: continuous-time noise, rate, range, and axes.
struct ImuNoise {
  double gyro_noise_density_radps_rthz = 1.6968e-4;
  double accel_noise_density_mps2_rthz = 2.0e-3;
  double gyro_random_walk_radps2_rthz = 1.9393e-5;
  double accel_random_walk_mps3_rthz = 3.0e-3;
  double rate_hz = 200;
  double max_gyro_radps = 36.7;  ///< a larger number cannot be a reading of this sensor; 2000 deg/s and 5 %
  double max_accel_mps2 = 185;   ///< likewise; 18 g and 5 %
  ImuIntrinsics axes = {};       ///< applied to readings once, where ImuHistory takes them
};

}  // namespace fbvins
