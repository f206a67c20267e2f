// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/motion_merge.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kMostWaiting = 1000;  // of one sensor while the other is silent

}  // namespace

void MotionMerge::add(std::deque<Reading>& readings, Time t, const Vec3& value) {
  if (!readings.empty() && t <= readings.back().t) {
    ++left_out_;
    return;
  }
  readings.push_back({t, value});
  if (readings.size() <= kMostWaiting) return;
  readings.pop_front();
  ++left_out_;
}

void MotionMerge::add_gyro(Time t, const Vec3& gyro_radps) { add(gyro_, t, gyro_radps); }
void MotionMerge::add_accel(Time t, const Vec3& accel_mps2) { add(accel_, t, accel_mps2); }

std::optional<ImuSample> MotionMerge::next() {
  while (!gyro_.empty() && !accel_.empty() && accel_.back().t >= gyro_.front().t) {
    const Reading gyro = gyro_.front();
    gyro_.pop_front();
    while (accel_.size() > 1 && accel_[1].t <= gyro.t) accel_.pop_front();
    const Reading& before = accel_.front();
    if (before.t == gyro.t) return ImuSample{gyro.t, gyro.value, before.value};
    if (before.t > gyro.t) continue;  // the accelerometer had not begun
    if (accel_[1].t - before.t > kLongestGap) {
      ++left_out_;
      continue;
    }
    const double share = (gyro.t - before.t).seconds() / (accel_[1].t - before.t).seconds();
    return ImuSample{gyro.t, gyro.value, before.value + share * (accel_[1].value - before.value)};
  }
  return std::nullopt;
}

}  // namespace fbvins
