// SPDX-License-Identifier: Apache-2.0
// Whether a reading can be one of this IMU's. The one judgement for every way in: live sensors, recordings, callers of System.
//
//   ReadingJudge judge(rig.imu_noise);
//   if (judge.accepts(sample)) use(sample);          // else it is counted
//
// A reading is refused if a number is not finite or beyond the sensor's range, if its stamp is not later than that of the
// last accepted one, or if it repeats the last one for longer than a sensor at rest does (a hung driver).
// Readings that one ReadingJudge has accepted are accepted by another. Threads: one owner.
#pragma once

#include <optional>

#include "fbvins/types/imu.hpp"
#include "fbvins/types/input_counts.hpp"

namespace fbvins {

class ReadingJudge {
 public:
  explicit ReadingJudge(const ImuNoise& imu = {}) : max_gyro_radps_(imu.max_gyro_radps), max_accel_mps2_(imu.max_accel_mps2) {}

  bool accepts(const ImuSample& reading);
  /// Whether the numbers are finite and within the sensor's range, whatever the stamp.
  bool plausible(const ImuSample& reading) const;
  const ImuCounts& counts() const { return counts_; }

 private:
  double max_gyro_radps_, max_accel_mps2_;
  std::optional<ImuSample> last_;  ///< accepted
  std::optional<Time> newest_;     ///< stamp of the last one that was accepted or a repetition
  Time same_since_;                ///< readings have had the numbers of `last_` since
  int repeats_ = 0;
  ImuCounts counts_;
};

}  // namespace fbvins
