// SPDX-License-Identifier: Apache-2.0
// The map of a live flight, written periodically during the flight, so that a killed program leaves a map.
#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "fbvins/core/time.hpp"
#include "fbvins/loop/loop_map.hpp"

namespace fbvins::app {

/// Runs on the thread of loop closure, for which the odometry does not wait. Warns once of a file that cannot be written.
class KeptMap final : public Mapper {
 public:
  using Told = std::function<void(const Result<void>& saved)>;

  /// `file` empty: the map is written only on request. `map` must outlive this.
  KeptMap(LoopMap& map, std::string file) : map_(map), file_(std::move(file)) {}
  MapUpdate process(const Keyframe& keyframe) override;

  /// The map is written after the next keyframe. From any thread.
  void request_save() { wanted_ = true; }
  /// To be called before the first keyframe: the file for requested maps, and who is told the result.
  void on_request(std::string file, Told told) { requested_file_ = std::move(file), told_ = std::move(told); }

 private:
  LoopMap& map_;
  std::string file_, requested_file_;
  Told told_;
  Time written_;  ///< keyframe's time
  bool warned_ = false;
  std::atomic<bool> wanted_{false};
};

}  // namespace fbvins::app
