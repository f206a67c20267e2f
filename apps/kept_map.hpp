// SPDX-License-Identifier: Apache-2.0
// The map of a live flight, written while the flight goes on, so that a killed program leaves one behind.
#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "fbvins/core/time.hpp"
#include "fbvins/loop/loop_map.hpp"

namespace fbvins::app {

/// On the thread of loop closure, which the odometry does not wait for; a file that cannot be written is said once.
class KeptMap final : public Mapper {
 public:
  using Told = std::function<void(const Result<void>& saved)>;

  /// `file` empty: nothing is written but on request. `map` outlives this.
  KeptMap(LoopMap& map, std::string file) : map_(map), file_(std::move(file)) {}
  MapUpdate process(const Keyframe& keyframe) override;

  /// The map is written after the next keyframe. From any thread.
  void request_save() { wanted_ = true; }
  /// Before the first keyframe: where a request's map goes, and who is told what became of it.
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
