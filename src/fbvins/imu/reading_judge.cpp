// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/reading_judge.hpp"

#include <cmath>

#include "fbvins/imu/nav_state.hpp"

namespace fbvins {
namespace {

/// A sensor of few bits, read faster than it measures, repeats itself for a few milliseconds.
constexpr double kLongestRepeat_s = 0.05;
/// At slower rates than that a few equal readings are chance.
constexpr int kFewestRepeats = 5;
/// A simulated sensor without noise repeats itself at rest, rightly; within this of rest it may.
constexpr double kRestRate_radps = 0.05, kRestForce_mps2 = 0.5;

bool as_at_rest(const ImuSample& s) {
  return s.gyro_radps.norm() < kRestRate_radps && std::abs(s.accel_mps2.norm() - kGravity_mps2) < kRestForce_mps2;
}

}  // namespace

bool ReadingJudge::plausible(const ImuSample& reading) const {
  return reading.gyro_radps.allFinite() && reading.accel_mps2.allFinite() &&
         reading.gyro_radps.cwiseAbs().maxCoeff() <= max_gyro_radps_ &&
         reading.accel_mps2.cwiseAbs().maxCoeff() <= max_accel_mps2_;
}

bool ReadingJudge::accepts(const ImuSample& reading) {
  if (!plausible(reading)) {
    ++counts_.invalid;
    return false;
  }
  if (newest_ && reading.t <= *newest_) {
    ++(reading.t == *newest_ ? counts_.duplicate : counts_.backward);
    return false;
  }
  newest_ = reading.t;
  const bool same = last_ && reading.gyro_radps == last_->gyro_radps && reading.accel_mps2 == last_->accel_mps2;
  if (!same) same_since_ = reading.t;
  repeats_ = same ? repeats_ + 1 : 0;
  if (repeats_ >= kFewestRepeats && (reading.t - same_since_).seconds() > kLongestRepeat_s && !as_at_rest(reading)) {
    ++counts_.repeated;
    return false;
  }
  last_ = reading;
  ++counts_.accepted;
  return true;
}

}  // namespace fbvins
