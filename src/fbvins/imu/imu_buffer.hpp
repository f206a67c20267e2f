// SPDX-License-Identifier: Apache-2.0
// Keeps the readings that arrive one by one and cuts them into segments between image stamps.
//
//   buffer.push(sample);                                  // from the driver or the dataset
//   if (buffer.covers(image.t))                           // a reading at or after the stamp is here
//     packet.imu = *buffer.extract(previous.t, image.t);  // ends interpolated, older readings dropped
//
// Threads: one owner. Memory: at most `capacity` readings; the oldest go first and are counted.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/types/imu.hpp"
#include "fbvins/types/input_counts.hpp"

namespace fbvins {

struct ImuBufferOptions {
  int capacity = 20000;                   ///< readings kept at most (100 s at 200 Hz)
  double longest_interpolation_s = 0.02;  ///< neighbours further apart: the nearest value is held instead
  double max_gyro_radps = 70;             ///< a larger number is a broken reading (4000 deg/s)
  double max_accel_mps2 = 700;            ///< likewise (70 g)
};

class ImuBuffer {
 public:
  explicit ImuBuffer(const ImuBufferOptions& options = {});

  /// False (and counted) when the reading is rejected.
  bool push(const ImuSample& sample);

  /// A reading at or after `to` is here, so that a segment up to `to` is final.
  bool covers(Time to) const;

  /// The readings in (from, to) with both ends interpolated; nothing until covers(to), or unless from < to.
  /// An end whose neighbours are far apart, or that has only one neighbour, holds the nearest value, and
  /// longest_gap says how far the readings touching [from, to] were apart.
  /// Readings that no later segment starting at `to` needs are dropped.
  std::optional<ImuSegment> extract(Time from, Time to);

  /// As extract(), without waiting for the reading after `to`: when the data ended or the IMU is silent.
  /// Empty segment when there is no reading at all.
  ImuSegment extract_now(Time from, Time to);

  bool empty() const { return samples_.empty(); }
  int size() const { return static_cast<int>(samples_.size()); }
  const ImuBufferCounts& counts() const { return counts_; }
  void clear() { samples_.clear(); }

 private:
  ImuSample at(Time t) const;
  Duration longest_gap(Time from, Time to) const;
  void drop_before(Time t);

  ImuBufferOptions options_;
  ImuBufferCounts counts_;
  std::vector<ImuSample> samples_;  ///< stamps strictly increasing
  std::optional<Time> newest_;      ///< survives dropping
};

}  // namespace fbvins
