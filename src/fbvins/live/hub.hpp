// SPDX-License-Identifier: Apache-2.0
// Distributes events to sinks, each on a thread of its own behind a queue that drops its oldest event: a sink that hangs does
// not affect the others.
//
//   hub.add(std::make_unique<Printer>());
//   hub.publish(pose);                        // any thread; never waits for a sink
//   Result<void> done = hub.finish();
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/live/live_event.hpp"
#include "fbvins/live/sink.hpp"

namespace fbvins {

class Hub {
 public:
  struct Limits {
    std::size_t events = 8192;  ///< that may wait for one sink: about ten seconds of them
    std::size_t images = 32;    ///< of them stereo frames, which need much memory
  };
  struct SinkReport {
    std::string name;
    std::int64_t taken = 0, dropped = 0;
    std::string problem;  ///< its first error; empty: none
    std::string passing;  ///< Sink::problem()
    std::vector<OutputFigure> figures;
  };

  Hub() : Hub(Limits{}) {}
  explicit Hub(Limits limits);
  ~Hub();

  /// Before the first publish().
  void add(std::unique_ptr<Sink> sink);
  bool empty() const { return queues_.empty(); }
  /// Whether any sink does now.
  bool wants_views() const;
  void publish(LiveEvent event);
  std::vector<SinkReport> reports() const;
  /// Lets every sink take what waits for it, and ends it. Returns the first error of any.
  Result<void> finish();

 private:
  class SinkQueue;
  Limits limits_;
  std::vector<std::unique_ptr<SinkQueue>> queues_;
};

}  // namespace fbvins
