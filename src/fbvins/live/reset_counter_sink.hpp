// SPDX-License-Identifier: Apache-2.0
// The reset counter, kept in a file from process to process: a flight controller outlives this program, and only a counter that
// differs from the last one tells it that W is a new frame.
//
//   auto counter = std::make_unique<ResetCounterSink>("reset_counter");
//   auto live = LiveSystem::create(system, options, rig, clock_rate, parts, counter->first());
//   live->add_sink(std::move(counter));
#pragma once

#include <cstdint>
#include <string>

#include "fbvins/core/atomic_file.hpp"
#include "fbvins/live/sink.hpp"
#include "fbvins/mavlink/flown_map.hpp"

namespace fbvins {

/// The file holds the newest counter that was published, with the jumps of M (FlownMap), which MAVLink adds to it where poses are
/// in M: it is written before the first pose, and after each restart of the estimator and each jump. One that cannot be written
/// is reported as the sink's error.
class ResetCounterSink final : public Sink {
 public:
  explicit ResetCounterSink(std::string file, WriteFile write = write_file_atomically);

  std::uint32_t first() const { return first_; }
  /// There is a file, but no counter in it: the first one is then 128, far from what most flights reach.
  bool was_unreadable() const { return unreadable_; }
  std::string_view name() const override { return "reset counter"; }
  Result<void> take(const LiveEvent& event) override;

 private:
  Result<void> keep(std::uint32_t counter);

  std::string file_;
  WriteFile write_;
  bool unreadable_ = false;
  std::uint32_t first_ = 0, kept_ = 0;
  FlownMap map_;
  Result<void> first_kept_;
};

}  // namespace fbvins
