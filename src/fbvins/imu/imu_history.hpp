// SPDX-License-Identifier: Apache-2.0
// The readings of an IMU: judged as they come, corrected by the calibration of its axes (ImuNoise::axes), kept once, on the
// images' clock. Cuts them into segments between two times, interpolates, and says what is missing.
//
//   ImuHistory history(rig.imu_noise, Duration::from_seconds(rig.time_offset_s));
//   history.add(sample);                                        // from the driver or the dataset, on the IMU's clock
//   if (history.covers(image.t))                                // a reading at or after the stamp is here
//     packet.imu = history.between(previous.t, image.t);        // ends interpolated
//   history.forget_before(image.t);
//
// Threads: one owner. Memory: at most `capacity` readings; the oldest go first and are counted.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/core/sample_period.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/imu/reading_judge.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

struct ImuHistoryOptions {
  int capacity = 20000;                   ///< readings kept at most (100 s at 200 Hz)
  double longest_interpolation_s = 0.02;  ///< neighbours further apart: the nearest value is held instead
  double longest_hold_s = 0.3;            ///< a segment in the middle of a longer gap is empty
};

class ImuHistory {
 public:
  /// time_offset: t_imu = t_image + offset.
  explicit ImuHistory(const ImuNoise& imu = {}, Duration time_offset = {}, const ImuHistoryOptions& options = {});

  /// A reading with its stamp on the IMU's clock. False (and counted) when it is refused.
  bool add(const ImuSample& reading);

  /// From now on times are on the images' clock by this offset, also of the readings that are here.
  void set_time_offset(Duration offset);

  /// A reading at or after `t` is here, so that a segment up to `t` is final. All times are on the images' clock.
  bool covers(Time t) const { return !readings_.empty() && readings_.back().t >= t; }

  /// The readings in (from, to) with both ends interpolated. An end whose neighbours are far apart, or that has only one
  /// neighbour, holds the nearest value, and longest_gap says how far the readings touching [from, to] are apart, or how long
  /// ago the last one was. Of an IMU that has never shown more than 50 readings a second a step of its own is no gap: it counts
  /// as 50 ms at most, and ends are interpolated in it. Empty where the readings are missing, or unless from < to.
  ImuSegment between(Time from, Time to) const;

  /// Drops the readings that no segment from `t` on needs.
  void forget_before(Time t);

  /// The last reading that was taken, corrected; there is one.
  const ImuSample& newest() const { return readings_.back(); }
  int size() const { return static_cast<int>(readings_.size()); }
  ImuCounts counts() const;

 private:
  ImuSample at(Time t) const;
  Duration longest_gap(Time from, Time to) const;
  void note_period(Duration interval);
  bool is_own_step(Duration step) const;

  Duration time_offset_;
  ImuHistoryOptions options_;
  ReadingJudge judge_;
  ImuIntrinsics axes_;
  std::vector<ImuSample> readings_;  ///< on the images' clock, strictly increasing
  SamplePeriod period_;
  std::optional<Duration> shortest_period_;  ///< that it has shown
  int overflow_ = 0;
};

}  // namespace fbvins
