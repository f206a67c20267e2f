// SPDX-License-Identifier: Apache-2.0
// How many of the features observed a second ago are observed now, by tracking or after occlusion or blur.
// One instance, one thread; frames in order of time.
//
//   SurvivalMeter meter;
//   sum += meter.add(frame);                   // sum.now / sum.then is the share that survives a second
#pragma once

#include <deque>
#include <vector>

#include "fbvins/types/tracking.hpp"

namespace fbvins {

struct Survival {
  long then = 0;  ///< features observed a second ago
  long now = 0;   ///< those of them observed now
  Survival& operator+=(const Survival& other) {
    then += other.then, now += other.now;
    return *this;
  }
};

class SurvivalMeter {
 public:
  /// Zeros while the recording is younger than a second.
  Survival add(const TrackedFrame& frame);

 private:
  struct Sight {
    Time t;
    std::vector<std::int64_t> ids;  // sorted
  };
  std::deque<Sight> past_;
};

}  // namespace fbvins
