// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/system.hpp"

#include <fmt/format.h>

#include <atomic>
#include <optional>
#include <utility>

#include "fbvins/camera/camera_times.hpp"
#include "fbvins/camera/check_rig.hpp"
#include "fbvins/camera/virtual_pinholes.hpp"
#include "fbvins/core/bounded_queue.hpp"
#include "fbvins/core/overloaded.hpp"
#include "fbvins/estimator/estimator.hpp"
#include "fbvins/estimator/estimator_setup.hpp"
#include "fbvins/pipeline/feedback.hpp"
#include "fbvins/pipeline/keyframe_anchors.hpp"
#include "fbvins/pipeline/keyframe_readings.hpp"
#include "fbvins/pipeline/packet_maker.hpp"
#include "fbvins/pipeline/stage_runner.hpp"

namespace fbvins {
namespace {

/// An error where a standing vehicle has no up, or where lenses that see more than 180 degrees are too many, or are to be
/// calibrated in flight.
Result<void> check_estimator(const EstimatorOptions& options, const VirtualPinholes& lenses) {
  const StandingOptions& s = options.standing;
  if (s.tilt_rad > 0 && Vec3(s.up_x, s.up_y, s.up_z).isZero(0))
    return Error{ErrorCode::invalid_argument, "estimator.standing: up_x, up_y and up_z are all zero: none says where up is"};
  if (!lenses.any()) return {};
  if (lenses.rig().camera_count() > kMostCameras)
    return Error{ErrorCode::unsupported,
                 fmt::format("the rig: a lens that sees more than 180 degrees counts as up to four cameras, which makes {} here, "
                             "more than {}",
                             lenses.rig().camera_count(), kMostCameras)};
  if (options.estimate_extrinsics)
    return Error{ErrorCode::unsupported, "estimator.estimate_extrinsics: not with lenses that see more than 180 degrees"};
  return {};
}

}  // namespace

/// A step of the work with its own queue and, in the threaded mode, its own thread.
template <class Task, class Owner>
struct Stage {
  const char* name;
  void (Owner::*step)(Task);
  BoundedQueue<Task> queue;
  StageRunner runner = {};
};

// images, IMU -> PacketMaker -[packets]-> Frontend -[tracked frames]-> Estimator -> Odometry
//                                            ^-------- Feedback -----------'  '-[keyframes]-> Mapper -> MapUpdate
struct System::Impl {
  struct MapTask {
    Keyframe keyframe;
    FrameId applies_from;
  };

  RunMode mode;
  ExposureOffsets own_offsets;  ///< of the rig's cameras
  VirtualPinholes lenses;       ///< makes of a wide lens the cameras that the frontend and the estimator are given
  PacketMaker packet_maker;
  std::unique_ptr<Frontend> frontend;
  Estimator estimator;
  Mapper* mapper;
  KeyframeImu imu_model;  ///< noise and gravity, the same for all keyframes
  KeyframeReadings readings;
  KeyframeAnchors anchors;
  Feedback feedback;

  std::function<void(const TrackedFrame&)> on_tracked_frame;
  std::function<void(const Keyframe&)> on_keyframe;
  std::function<void(const WindowSnapshot&)> on_window;
  std::function<bool()> window_wanted;
  std::function<void(const Odometry&)> on_odometry;
  std::function<void(const MapUpdate&)> on_map_update;

  StageStatus status;
  std::atomic<int> keyframes_left_out = 0;
  std::atomic<bool> start_again = false;
  bool finished = false;
  Stage<SensorPacket, Impl> tracking{"the frontend", &Impl::track, BoundedQueue<SensorPacket>{4}};
  Stage<TrackedFrame, Impl> estimation{"the estimator", &Impl::estimate, BoundedQueue<TrackedFrame>{4}};
  /// Deep enough for the keyframes of a second or two, while the mapper optimises its whole graph.
  Stage<MapTask, Impl> mapping{"the mapper", &Impl::map, BoundedQueue<MapTask>{12}};

  Impl(const SystemOptions& options, const StereoRig& rig, VirtualPinholes lenses_of_rig, RunMode mode_wanted, SystemParts parts)
      : mode(mode_wanted),
        own_offsets(fbvins::own_offsets(rig)),
        lenses(std::move(lenses_of_rig)),
        packet_maker(lenses.rig().imu_noise, Duration::from_seconds(lenses.rig().time_offset_s)),
        frontend(std::move(parts.frontend)),
        estimator(lenses.rig(), options.estimator, parts.imu_state, parts.sensors),
        mapper(parts.mapper),
        imu_model{{}, {}, assumed_noise(lenses.rig().imu_noise, options.estimator), options.estimator.gravity_mps2} {
    if (mode == RunMode::deterministic) return;
    start(tracking, [this] { estimation.queue.close(); });
    start(estimation, [this] { mapping.queue.close(); });
    start(mapping, [] {});
  }
  ~Impl() { (void)finish(); }

  // The steps of a frame, on whatever thread.

  void track(SensorPacket packet) {
    const Feedback::Message told = feedback.for_frame(packet.id);
    for (const LandmarkUpdate& update : told.landmarks) frontend->locate(update);
    StereoFrame images = packet.frame;
    packet.frame = lenses.spread(std::move(packet.frame));
    TrackedFrame frame = frontend->process(packet, told.prior);
    frame.id = packet.id;
    frame.t = packet.frame.t;
    frame.imu = std::move(packet.imu);
    frame.depth = packet.frame.depth;
    frame.offsets = packet.frame.offsets;
    frame.after_clock_step = packet.frame.after_clock_step;
    frame.anchors = std::move(packet.anchors);
    frame.aiding = std::move(packet.aiding);
    if (keyframes_wanted()) frame.images = std::move(images);
    hand_on(estimation, std::move(frame));
  }

  void estimate(TrackedFrame frame) {
    if (on_tracked_frame) on_tracked_frame(lenses.any() ? lenses.gathered(frame) : frame);
    if (start_again.exchange(false) || frame.after_clock_step) estimator.start_again(frame.after_clock_step);
    Estimate estimate = estimator.process(frame);
    std::uint8_t& without_cameras = estimate.odometry.health.without_cameras;
    without_cameras = lenses.lenses_of(without_cameras);
    frame.imu.noise = estimate.imu_noise;
    if (keyframes_wanted()) complete(estimate, frame);
    if (on_window && (!window_wanted || window_wanted())) on_window(estimator.snapshot());
    if (on_odometry) on_odometry(estimate.odometry);
    if (on_keyframe)
      for (const Keyframe& keyframe : estimate.keyframes) on_keyframe(keyframe);
    // After the callbacks, so that whoever waits for this frame sees whether one of them threw.
    feedback.publish(frame.id, estimator.prior(), std::move(estimate.landmarks));
    if (mapper != nullptr)
      for (Keyframe& keyframe : estimate.keyframes) hand_to_mapper({std::move(keyframe), FrameId{frame.id.value + 1}});
  }

  bool keyframes_wanted() const { return on_keyframe || mapper != nullptr; }

  /// Fills the parts of keyframes that the estimator does not know.
  void complete(Estimate& estimate, TrackedFrame& frame) {
    readings.add(frame.imu);
    anchors.add(std::move(frame.anchors));
    const Pose<W, G> T_WG = estimate.odometry.T_WB * estimate.odometry.gauge.T_GB.inverse();
    for (Keyframe& keyframe : estimate.keyframes) {
      keyframe.T_WG = T_WG;
      for (KeyframeLandmark& landmark : keyframe.landmarks) {
        landmark.pixel += lenses.origin_px(landmark.camera);
        landmark.camera = lenses.lens_of(landmark.camera);
      }
      keyframe.imu = {readings.until(keyframe.t), keyframe.imu.bias, imu_model.noise, imu_model.gravity_mps2};
      keyframe.anchors = anchors.until(keyframe.t);
    }
  }

  void map(MapTask task) {
    MapUpdate update = mapper->process(task.keyframe);
    update.applies_from = task.applies_from;
    if (on_map_update) on_map_update(update);
  }

  // The way from stage to stage.

  /// From here on `offsets` are those of the exposures, not of the stamps.
  void push(StereoFrame frame) {
    frame.offsets += own_offsets;
    packet_maker.push(std::move(frame));
  }

  Result<void> push(const AidingSample& reading) {
    if (const std::string why = impossible(reading); !why.empty()) return Error{ErrorCode::invalid_argument, why};
    packet_maker.push(reading);
    return {};
  }

  /// Sends on the packets that are ready; with `flush`, all that wait.
  void forward(bool flush) {
    while (const std::optional<FrameId> id = packet_maker.next_id(flush)) {
      // The frontend could not begin earlier, and the caller sees a failure in time.
      packet_maker.correct_time_offset(feedback.time_offset_for(*id));
      std::optional<SensorPacket> packet = packet_maker.next(flush);
      if (!packet) return;  // by the corrected offset its readings are not here yet
      hand_on(tracking, std::move(*packet));
    }
  }

  template <class Task>
  void hand_on(Stage<Task, Impl>& stage, Task task) {
    if (mode == RunMode::deterministic) run(stage, std::move(task));
    else stage.queue.push(std::move(task));
  }

  /// In flight nothing waits for the mapper: if it is behind, a keyframe is left out, and the next one has its readings.
  void hand_to_mapper(MapTask task) {
    if (mode != RunMode::live) return hand_on(mapping, std::move(task));
    if (!mapping.queue.push_if_room(task)) {
      readings.take_back(std::move(task.keyframe.imu.segments));
      anchors.add(std::move(task.keyframe.anchors));
      ++keyframes_left_out;
    }
  }

  /// Nothing is processed after a failure.
  template <class Task>
  void run(Stage<Task, Impl>& stage, Task task) {
    if (!status.get()) return;
    const Result<void> done = guarded(stage.name, [&] { (this->*stage.step)(std::move(task)); });
    if (!done) stop(done.error());
  }

  template <class Task, class AtEnd>
  void start(Stage<Task, Impl>& stage, AtEnd at_end) {
    stage.runner.start([this, &stage, at_end] {
      while (std::optional<Task> task = stage.queue.pop()) run(stage, std::move(*task));
      at_end();
    });
  }

  void stop(const Error& error) {
    status.fail(error);
    feedback.stop();
    tracking.queue.close();
    estimation.queue.close();
    mapping.queue.close();
  }

  Result<void> finish() {
    if (!std::exchange(finished, true)) {
      forward(true);
      tracking.queue.close();
      // All threads have ended before this returns, whichever stage failed: no callback comes later.
      tracking.runner.join();
      estimation.runner.join();
      mapping.runner.join();
    }
    return status.get();
  }
};

Result<System> System::create(const SystemOptions& options, const StereoRig& rig, RunMode mode, SystemParts parts) {
  if (Result<void> valid = validate(options); !valid) return valid.error();
  if (Result<void> good = check_rig(rig, "the rig"); !good) return good.error();
  VirtualPinholes lenses(rig);
  if (Result<void> good = check_estimator(options.estimator, lenses); !good) return good.error();
  if (!parts.frontend) {
    Result<std::unique_ptr<Frontend>> frontend = make_frontend(lenses.rig(), options.frontend);
    if (!frontend) return frontend.error();
    parts.frontend = std::move(*frontend);
  }
  return System(std::make_unique<Impl>(options, rig, std::move(lenses), mode, std::move(parts)));
}

System::System(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
System::~System() = default;
System::System(System&&) noexcept = default;
System& System::operator=(System&&) noexcept = default;

void System::on_tracked_frame(std::function<void(const TrackedFrame&)> callback) {
  impl_->on_tracked_frame = std::move(callback);
}
void System::on_keyframe(std::function<void(const Keyframe&)> callback) { impl_->on_keyframe = std::move(callback); }
void System::on_window(std::function<void(const WindowSnapshot&)> callback, std::function<bool()> wanted) {
  impl_->on_window = std::move(callback);
  impl_->window_wanted = std::move(wanted);
}
void System::on_odometry(std::function<void(const Odometry&)> callback) { impl_->on_odometry = std::move(callback); }
void System::on_map_update(std::function<void(const MapUpdate&)> callback) { impl_->on_map_update = std::move(callback); }

Result<void> System::push(SensorEvent event) {
  if (impl_->finished && impl_->status.get())
    return Error{ErrorCode::invalid_argument, "push() after finish(): the system has ended"};
  const Result<void> taken =
      std::visit(Overloaded{[this](ImuSample& sample) { return impl_->packet_maker.push(sample), Result<void>{}; },
                            [this](StereoFrame& frame) { return impl_->push(std::move(frame)), Result<void>{}; },
                            [this](const AidingSample& reading) { return impl_->push(reading); }},
                 event);
  if (!taken) return taken;
  impl_->forward(false);
  return impl_->status.get();
}

Result<void> System::push(Anchor anchor) {
  if (impl_->finished && impl_->status.get())
    return Error{ErrorCode::invalid_argument, "push() after finish(): the system has ended"};
  if (const std::string why = impossible(anchor); !why.empty()) return Error{ErrorCode::invalid_argument, why};
  impl_->packet_maker.push(std::move(anchor));
  return impl_->status.get();
}

void System::start_again() { impl_->start_again = true; }
Result<void> System::finish() { return impl_->finish(); }
Result<void> System::status() const { return impl_->status.get(); }
InputCounts System::input_counts() const { return impl_->packet_maker.counts(); }
int System::keyframes_left_out() const { return impl_->keyframes_left_out; }
Calibration System::calibration() const {
  Calibration out = impl_->lenses.of_lenses(impl_->estimator.calibration());
  out.time_offset_s += impl_->estimator.time_alignment().correction().seconds();
  out.line_delay_s += impl_->estimator.time_alignment().line_delay_correction_s();
  return out;
}

}  // namespace fbvins
