// SPDX-License-Identifier: Apache-2.0
// Puts IMU readings in order of their stamps with a bounded wait. A reading that follows its predecessor by about one period
// is released at once; one after a gap waits for readings that may still come, but no longer than `longest_wait`.
// Threads: one owner.
#pragma once

#include <functional>
#include <map>
#include <optional>

#include "fbvins/core/sample_period.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

class ImuOrder {
 public:
  using Release = std::function<void(const ImuSample&)>;

  explicit ImuOrder(Duration longest_wait) : longest_wait_(longest_wait) {}

  /// Takes a reading that came at `host`; calls `release` for every reading that is next in order.
  void push(const ImuSample& sample, Time host, const Release& release);
  /// Releases what has waited long enough at `host`.
  void tick(Time host, const Release& release);
  /// Releases everything.
  void flush(const Release& release);

  int late() const { return late_; }            ///< dropped: a reading with the same or a later stamp was released before
  int reordered() const { return reordered_; }  ///< came after a later one and was released before it

 private:
  struct Waiting {
    ImuSample sample;
    Time since;
  };
  bool is_next(Time t) const;
  void release_front(const Release& release);

  Duration longest_wait_;
  std::map<Time, Waiting> waiting_;
  std::optional<Time> newest_;
  SamplePeriod period_;
  int late_ = 0, reordered_ = 0;
};

}  // namespace fbvins
