// SPDX-License-Identifier: Apache-2.0
// Merges a gyroscope and an accelerometer that are read separately, at different rates, into one IMU.
//
//   merge.add_gyro(t, radps); merge.add_accel(t, mps2);
//   while (auto sample = merge.next()) input.push(*sample);
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "fbvins/types/imu.hpp"

namespace fbvins {

/// Gives one reading for each of the gyroscope's, in order, with the specific force interpolated linearly between its neighbours
/// in time, as soon as the later of these has arrived. None where the accelerometer was silent for longer than kLongestGap.
/// One thread at a time.
class MotionMerge {
 public:
  static constexpr Duration kLongestGap{50'000'000};

  /// Stamps of each ascend; one that does not is dropped.
  void add_gyro(Time t, const Vec3& gyro_radps);
  void add_accel(Time t, const Vec3& accel_mps2);
  std::optional<ImuSample> next();
  /// Readings that were dropped: their stamps do not ascend, or the other sensor was silent for too long.
  std::int64_t left_out() const { return left_out_; }

 private:
  struct Reading {
    Time t;
    Vec3 value;
  };
  void add(std::deque<Reading>& readings, Time t, const Vec3& value);
  std::deque<Reading> gyro_, accel_;
  std::int64_t left_out_ = 0;
};

}  // namespace fbvins
