// SPDX-License-Identifier: Apache-2.0
// The whole odometry: images and IMU readings in, poses out.
//
//   System system(config, dataset->rig(), RunMode::deterministic);
//   system.on_odometry([&](const Odometry& o) { writer.write(o); });
//   while (auto event = dataset->next()) system.push(std::move(*event));
//   Result<void> end = system.finish();
//
// With a LoopCloser, keyframes go on to it and T_MW comes back through on_map_update().
//
// Threads: push() and finish() are called by one thread. `deterministic` runs everything on it;
// `threaded` runs the frontend, the estimator and the loop closer each on a thread of their own, where
// they call back. Both give the same bits: the frontend of frame k always sees the estimator's state
// after frame k - 2, so that the two can work side by side, and nothing flows back from the loop closer.
#pragma once

#include <array>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/bounded_queue.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/estimator/estimator.hpp"
#include "fbvins/frontend/frontend.hpp"
#include "fbvins/frontend/frontend_options.hpp"
#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/pipeline/packet_maker.hpp"
#include "fbvins/pipeline/stage_runner.hpp"
#include "fbvins/types/odometry.hpp"
#include "fbvins/types/sensor_event.hpp"

namespace fbvins {

enum class RunMode { deterministic, threaded };

/// Everything that can be configured.
struct Config {
  FrontendOptions frontend;
  EstimatorOptions estimator;
  PacketMakerOptions input;
  LoopOptions loop;

  template <class V>
  void visit(V&& v) {
    v.group("frontend", frontend, "features and their tracks");
    v.group("estimator", estimator, "sliding window");
    v.group("input", input, "sensor data on its way in");
    v.group("loop", loop, "loop closure, where it is asked for");
  }
};

class System {
 public:
  System(const Config& config, const StereoRig& rig, RunMode mode, std::unique_ptr<LoopCloser> loop = nullptr);
  ~System();
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  using TrackedFrameCallback = std::function<void(const TrackedFrame&)>;
  using KeyframeCallback = std::function<void(const Keyframe&)>;
  using OdometryCallback = std::function<void(const Odometry&)>;
  using MapUpdateCallback = std::function<void(const MapUpdate&)>;
  void on_tracked_frame(TrackedFrameCallback callback) { on_tracked_frame_ = std::move(callback); }
  /// Keyframes as they become final, with their images: for loop closure.
  void on_keyframe(KeyframeCallback callback) { on_keyframe_ = std::move(callback); }
  void on_odometry(OdometryCallback callback) { on_odometry_ = std::move(callback); }
  /// After every keyframe that the loop closer has seen.
  void on_map_update(MapUpdateCallback callback) { on_map_update_ = std::move(callback); }

  /// Takes the next sensor event, in order of time. Blocks while the stages are behind (threaded).
  void push(SensorEvent event);
  /// Processes what is waiting and ends; no callback comes afterwards. An error if a stage or a callback threw, or the
  /// frontend could not be made.
  Result<void> finish();

  /// Why nothing is or will be processed; empty while all is well (in the deterministic mode; threads tell at finish()).
  const std::string& failure() const { return failure_; }
  InputCounts input_counts() const { return packets_.counts(); }
  const Estimator& estimator() const { return estimator_; }
  /// The map; null where there is no loop closure. Only after finish().
  LoopCloser* loop() { return loop_.get(); }

 private:
  struct LoopTask {
    Keyframe keyframe;
    FrameId applies_from;
  };
  void forward_packets(bool flush);
  void track(SensorPacket packet);
  void estimate(const TrackedFrame& frame);
  void hand_on(const Estimate& estimate);
  void close_loops(const LoopTask& task);
  StatePrior feedback_for(FrameId frame);
  void publish(FrameId frame, const StatePrior& prior, LandmarkUpdate landmarks);
  void stop_waiting();

  RunMode mode_;
  PacketMaker packets_;
  std::unique_ptr<Frontend> frontend_;
  Estimator estimator_;
  std::unique_ptr<LoopCloser> loop_;
  TrackedFrameCallback on_tracked_frame_;
  KeyframeCallback on_keyframe_;
  OdometryCallback on_odometry_;
  MapUpdateCallback on_map_update_;

  BoundedQueue<SensorPacket> to_frontend_{4};
  BoundedQueue<TrackedFrame> to_estimator_{4};
  /// Deep enough for the keyframes of a second or two, while the loop closer optimises its whole graph.
  BoundedQueue<LoopTask> to_loop_{12};
  StageRunner frontend_runner_, estimator_runner_, loop_runner_;
  bool finished_ = false;
  std::string failure_;  ///< of the first stage that threw; the caller's thread only

  // The feedback slot: the states after the last frames, and how far the estimator has come.
  std::mutex prior_mutex_;
  std::condition_variable prior_published_;
  std::array<StatePrior, 4> priors_;
  std::deque<LandmarkUpdate> landmark_updates_;  ///< not yet seen by the frontend; one a frame
  std::int64_t frames_estimated_ = 0;
  bool stopped_ = false;
};

}  // namespace fbvins
