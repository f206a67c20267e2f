// SPDX-License-Identifier: Apache-2.0
// The readings of a recording, with their integrals over any interval. A value; const members from any thread.
//
//   ImuSeries imu(samples);
//   if (imu.covers(a, b)) Vec3 turned = imu.turned(a, b);      // rad, the integral of the rate
#pragma once

#include <span>
#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

class ImuSeries {
 public:
  /// Readings whose stamps do not ascend are left out.
  explicit ImuSeries(std::span<const ImuSample> samples);

  const std::vector<ImuSample>& samples() const { return samples_; }
  bool empty() const { return samples_.size() < 2; }
  /// There are readings from a to b, without a gap.
  bool covers(Time a, Time b) const;
  /// Interpolated; before the first and after the last reading, that reading.
  ImuSample at(Time t) const;
  /// Integral of the angular rate from a to b, rad in B: the rotation vector, if the axis stays nearly the same.
  Vec3 turned(Time a, Time b) const { return integral(b) - integral(a); }
  /// The readings from a to b, with both ends interpolated.
  ImuSegment segment(Time a, Time b) const;
  /// The same readings with every angular rate multiplied by `gyro` (other axes or units).
  ImuSeries with_gyro(const Mat3& gyro) const;
  /// The same angular rates, each with the specific force that was read `later` after it.
  ImuSeries with_accel(Duration later) const;

 private:
  std::size_t first_after(Time t) const;
  Vec3 integral(Time t) const;

  std::vector<ImuSample> samples_;
  std::vector<Vec3> integral_;  // of the rate, from the first reading to each
};

}  // namespace fbvins
