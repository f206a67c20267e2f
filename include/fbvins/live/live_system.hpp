// SPDX-License-Identifier: Apache-2.0
// The odometry on live sensors: data in from any thread, the pose out at IMU rate, sinks that cannot hold it up.
//
//   Result<LiveSystem> live = LiveSystem::create(system_options, live_options, source->rig());
//   if (!live) return report(live.error().message);
//   live->add_sink(std::make_unique<Printer>());
//   Result<void> end = source->run(live->input());   // in this thread; input() may be used by others as well
//   Result<void> done = live->finish();
//
// An image that comes while older ones are being processed waits; when the next one comes it is dropped and counted. IMU
// readings are never dropped. Silent or frozen sensors and clock jumps are detected, and estimation goes on when the sensors
// are back (docs/live.md).
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/live/live_event.hpp"
#include "fbvins/live/live_options.hpp"
#include "fbvins/live/sink.hpp"
#include "fbvins/live/source.hpp"
#include "fbvins/pipeline/system.hpp"

namespace fbvins {

class LiveSystem {
 public:
  /// `clock_rate`: Source::clock_rate(). `first_reset_counter`: of the first W that is published, another one than the process
  /// before ended with, so that a flight controller that outlives this process notices the new W. Errors as System::create.
  static Result<LiveSystem> create(const SystemOptions& system, const LiveOptions& options, const StereoRig& rig,
                                   double clock_rate = 1, SystemParts parts = {}, std::uint32_t first_reset_counter = 0);
  ~LiveSystem();
  LiveSystem(LiveSystem&&) noexcept;
  LiveSystem& operator=(LiveSystem&&) noexcept;

  /// Before the first reading.
  void add_sink(std::unique_ptr<Sink> sink);
  /// What the frontend saw in an image, on the thread of the estimator; to be set before the first reading.
  void on_tracked_frame(std::function<void(const TrackedFrame&)> callback);
  /// Once, when a stage has failed and nothing more is taken: a source can be stopped here, but not finish() be called.
  /// Before the first reading.
  void on_failure(std::function<void()> callback);

  SensorInput& input();
  /// A reading of an aiding sensor that is stamped on this machine's CLOCK_MONOTONIC, as a flight controller's: right to the
  /// shortest delay of the images. Left out before the first image. From any thread.
  void push_of_host(AidingSample reading);
  /// The estimator starts again with the next image (System::start_again). From any thread.
  void start_again();
  /// Sends a LiveMark to the sinks. From any thread.
  void mark(std::string text);
  /// From any thread.
  LiveStatus status() const;
  /// Processes what is waiting, then ends the sinks. Returns the first failure of a stage, else the first of a sink.
  Result<void> finish();

 private:
  struct Impl;
  explicit LiveSystem(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace fbvins
