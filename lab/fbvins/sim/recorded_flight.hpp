// SPDX-License-Identifier: Apache-2.0
// Makes a smooth trajectory of a recorded one, alone or with its real IMU recording. With the IMU, the result
// follows the trajectory below a crossover frequency and the IMU's integral above it, so that images rendered
// along it agree with the unchanged IMU data. Pure functions.
#pragma once

#include "fbvins/core/result.hpp"
#include "fbvins/io/trajectory.hpp"
#include "fbvins/sim/imu_model.hpp"

namespace fbvins {

struct RecordedFlight {
  SplineTrajectory flight;
  Time start;        ///< stamp of the spline's time 0
  SimulatedImu imu;  ///< empty without a real IMU
};

/// From a trajectory alone: low-pass filtered at 3 * `crossover_hz`, resampled at equal intervals.
Result<RecordedFlight> fly_again(const std::vector<TrajectoryPoint>& points, double crossover_hz);

/// With the IMU: one knot per sample; the truth's biases are the difference between readings and result.
Result<RecordedFlight> fly_again(const std::vector<TrajectoryPoint>& points, const std::vector<ImuSample>& imu,
                                 double crossover_hz);

/// x that minimises sum |x_k - y_k|^2 + lambda * sum |(x_k-1 - 2 x_k + x_k+1) - c_k|^2: y below the
/// frequency where lambda * (2 pi f dt)^4 = 1, the double sum of c above it, without any delay.
std::vector<Vec3> blend_second_differences(const std::vector<Vec3>& y, const std::vector<Vec3>& c, double lambda);

}  // namespace fbvins
