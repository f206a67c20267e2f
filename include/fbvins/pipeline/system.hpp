// SPDX-License-Identifier: Apache-2.0
// The whole odometry: images and IMU readings in, poses out.
//
//   Result<System> system = System::create(options, rig);
//   if (!system) return report(system.error().message);
//   system->on_odometry([&](const Odometry& o) { use(o.T_WB, o.health); });
//   while (std::optional<SensorEvent> event = next())
//     if (Result<void> taken = system->push(std::move(*event)); !taken) return report(taken.error().message);
//   Result<void> end = system->finish();
//
// A custom frontend, or a mapper, is passed as a part:
//
//   System::create(options, rig, RunMode::threaded, {.frontend = std::make_unique<MyFrontend>(rig), .mapper = &map});
//
// Threads: callbacks are set before the first push(); push() and finish() are called by one thread, status() and start_again() by
// any.
// `deterministic` runs everything on the caller's thread; `threaded` runs the frontend, the estimator and the mapper each
// on a thread of its own, where they call back. Both give the same bits. `live` is `threaded`, but a mapper that is behind
// leaves out keyframes instead of holding up the odometry, which is the same.
//
// Failures: an exception in a stage or a callback ends the work. push() returns it from then on, at the latest two images
// after the one that failed in the frontend or the estimator (the mapper may be behind by its queue), and so does finish().
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/estimator/own_sensor.hpp"
#include "fbvins/frontend/frontend.hpp"
#include "fbvins/pipeline/system_options.hpp"
#include "fbvins/types/anchor.hpp"
#include "fbvins/types/calibration.hpp"
#include "fbvins/types/imu_state.hpp"
#include "fbvins/types/input_counts.hpp"
#include "fbvins/types/mapper.hpp"
#include "fbvins/types/odometry.hpp"
#include "fbvins/types/sensor_event.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

enum class RunMode { deterministic, threaded, live };

/// Parts that a user may provide: instead of those that the options name, or from an earlier flight.
struct SystemParts {
  std::unique_ptr<Frontend> frontend = {};               ///< instead of `options.frontend.kind`
  Mapper* mapper = nullptr;                              ///< gets every keyframe; not owned, must live longer than the System
  std::optional<ImuState> imu_state = {};                ///< this IMU's biases at the end of an earlier flight
  std::vector<std::shared_ptr<OwnSensor>> sensors = {};  ///< that the library does not know
};

class System {
 public:
  /// An error if an option is out of its range, the rig cannot fly (check_rig.hpp) or the frontend cannot be made (its name, the
  /// booster's weights).
  static Result<System> create(const SystemOptions& options, const StereoRig& rig, RunMode mode = RunMode::deterministic,
                               SystemParts parts = {});
  ~System();
  System(System&&) noexcept;
  System& operator=(System&&) noexcept;

  /// The frontend's result for every image.
  void on_tracked_frame(std::function<void(const TrackedFrame&)> callback);
  /// Keyframes as they become final, with their images.
  void on_keyframe(std::function<void(const Keyframe&)> callback);
  /// The window after every image, before its odometry, from the estimator's thread; levelled, but not smoothed as T_WB is.
  /// `wanted` is asked there before each; without it all are.
  void on_window(std::function<void(const WindowSnapshot&)> callback, std::function<bool()> wanted = {});
  /// One for every image, with or without a pose (see `health`).
  void on_odometry(std::function<void(const Odometry&)> callback);
  /// After every keyframe that the mapper has processed.
  void on_map_update(std::function<void(const MapUpdate&)> callback);

  /// Takes the next sensor event, in order of time. Blocks while the stages are behind (threaded). Returns the error of the
  /// stage that failed, if one has; the event is dropped then. An error, and no change, for an impossible reading of an aiding
  /// sensor.
  Result<void> push(SensorEvent event);
  /// A measurement for the mapper, of the images' clock; between the events, best before the next image. One that comes late is
  /// used as long as the map remembers the motion then (some seconds). An error, and no change, for one that is impossible.
  Result<void> push(Anchor anchor);
  /// From the next image on the odometry starts again, as after `lost`: a new W, placed at the last pose, and `reset_counter`
  /// + 1. Before the first start nothing. Any thread.
  void start_again();
  /// Processes what is waiting and ends; no callback comes afterwards. Returns the same on every call.
  Result<void> finish();
  /// The first failure of a stage, or success.
  Result<void> status() const;

  InputCounts input_counts() const;
  /// Keyframes that the mapper was not given because it was busy with older ones (`live`). Any thread.
  int keyframes_left_out() const;
  /// The camera-IMU calibration as estimated; only after finish().
  Calibration calibration() const;

 private:
  struct Impl;
  explicit System(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace fbvins
