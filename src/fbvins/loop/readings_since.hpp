// SPDX-License-Identifier: Apache-2.0
// Private: the IMU's readings since the newest keyframe of the map, for the edge from it to the next one. One thread at a time.
//
//   ReadingsSince readings;
//   readings.add(keyframe.imu.segments, keyframe.t, newest_t);      // every keyframe, also those that the map does not take
//   edge.imu = readings.until(keyframe.t, newest_t, keyframe.imu);
//   readings.restart();                                             // the map has taken one
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "fbvins/imu/preintegration.hpp"
#include "fbvins/types/keyframe.hpp"

namespace fbvins {

class ReadingsSince {
 public:
  /// `read`: up to `t`. `newest_t`: of the keyframe that they count from; none while there is none.
  void add(const std::vector<ImuSegment>& read, Time t, std::optional<Time> newest_t);
  /// All of them; null where some are missing, or they last longer than an edge may.
  std::shared_ptr<const Preintegration> until(Time t, Time newest_t, const KeyframeImu& imu) const;
  void restart();

 private:
  std::vector<ImuSegment> readings_;
  bool missing_ = false;
};

}  // namespace fbvins
