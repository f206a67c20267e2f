// SPDX-License-Identifier: Apache-2.0
// The map of a live flight, written while the flight goes on, so that a killed program leaves one behind.
#pragma once

#include <string>

#include "fbvins/core/time.hpp"
#include "fbvins/loop/loop_map.hpp"

namespace fbvins::app {

/// On the thread of loop closure, which the odometry does not wait for; a file that cannot be written is said once.
class KeptMap final : public Mapper {
 public:
  /// `file` empty: nothing is written. `map` outlives this.
  KeptMap(LoopMap& map, std::string file) : map_(map), file_(std::move(file)) {}
  MapUpdate process(const Keyframe& keyframe) override;

 private:
  LoopMap& map_;
  std::string file_;
  Time written_;  ///< keyframe's time
  bool warned_ = false;
};

}  // namespace fbvins::app
