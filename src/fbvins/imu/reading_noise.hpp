// SPDX-License-Identifier: Apache-2.0
// How much worse than usual the readings of an IMU are: what airframes shake, a single wrong reading, an axis at the end of its
// range. The estimator's noise (ImuNoise, assumed) covers the vibration of smooth airframes; what is beyond it raises that
// noise by a factor, so that readings count as much as they are worth.
//
//   ReadingNoise noise(assumed);
//   segment.noise = noise.of(segment);       // segments in order
//
// Vibration is measured by second differences, which motion hardly touches (J. von Neumann et al., "The mean square successive
// difference", Annals of Mathematical Statistics 1941; here of second order). One owner, one thread.
#pragma once

#include <algorithm>
#include <cmath>
#include <deque>

#include "fbvins/types/imu.hpp"

namespace fbvins {

class ReadingNoise {
 public:
  /// `axes`: the share by which the accelerometer's axes and scale are off; those that are not calibrated by 1 to 3 %.
  explicit ReadingNoise(const ImuNoise& assumed, double axes = 0.015) : assumed_(assumed), axes_(axes) {}

  ImuNoiseScale of(const ImuSegment& segment);
  /// Whether an axis was at the end of its range in the last segment, and in one of the four before.
  bool clipped() const { return (gyro_clipped_ || accel_clipped_) && clipped_before_ > 0; }
  /// Root mean square of the last quarter of a second, rad/s and m/s^2, at frequencies far above those of motion.
  double gyro_vibration_radps() const { return gyro_radps_; }
  double accel_vibration_mps2() const { return accel_mps2_; }

 private:
  struct Difference {
    Time t;
    double gyro2, accel2;  ///< squared, one axis
  };
  /// Mean and variance of an axis over the last second or so.
  struct Changes {
    Vec3 mean = Vec3::Zero();
    double variance = -1;  ///< below zero: nothing came yet
    void add(const Vec3& value, double dt_s);
    double sigma() const { return std::sqrt(std::max(0.0, variance)); }
  };
  void add(const ImuSample& reading);

  ImuNoise assumed_;
  double axes_;
  std::deque<ImuSample> last_;  ///< two at most
  std::deque<Difference> differences_;
  Changes changes_;
  int gyro_same_[3] = {}, accel_same_[3] = {};  ///< readings in a row with the same large number
  bool gyro_clipped_ = false, accel_clipped_ = false;
  int clipped_before_ = 0;  ///< segments for which that of an earlier one counts
  double gyro_radps_ = 0, accel_mps2_ = 0;
  double largest_gyro_radps_ = 0;                       ///< so far, of an axis
  double worst_gyro_radps_ = 0, worst_accel_mps2_ = 0;  ///< single readings of the segment
};

}  // namespace fbvins
