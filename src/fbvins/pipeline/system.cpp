// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/system.hpp"

namespace fbvins {
namespace {

/// The frontend of frame k sees the state after frame k - kPriorLag, in every mode.
constexpr std::int64_t kPriorLag = 2;

}  // namespace

System::System(const Config& config, const StereoRig& rig, RunMode mode, std::unique_ptr<LoopCloser> loop)
    : mode_(mode),
      packets_(config.input, Duration::from_seconds(rig.time_offset_s)),
      estimator_(rig, config.estimator),
      loop_(std::move(loop)) {
  if (Result<std::unique_ptr<Frontend>> frontend = make_frontend(rig, config.frontend)) frontend_ = std::move(*frontend);
  else failure_ = frontend.error().message;
  if (!failure_.empty()) mode_ = RunMode::deterministic;  // nothing will be processed
  if (mode_ != RunMode::threaded) return;
  frontend_runner_.start(
      [this] {
        while (auto packet = to_frontend_.pop()) track(std::move(*packet));
        to_estimator_.close();
      },
      [this] { stop_waiting(); });
  estimator_runner_.start(
      [this] {
        while (auto frame = to_estimator_.pop()) estimate(*frame);
        to_loop_.close();
      },
      [this] { stop_waiting(); });
  loop_runner_.start(
      [this] {
        while (auto task = to_loop_.pop()) close_loops(*task);
      },
      [this] { stop_waiting(); });
}

System::~System() { (void)finish(); }

void System::push(SensorEvent event) {
  if (auto* sample = std::get_if<ImuSample>(&event)) packets_.push(*sample);
  else packets_.push(std::get<StereoFrame>(std::move(event)));
  forward_packets(false);
}

void System::forward_packets(bool flush) {
  while (auto packet = packets_.next(flush)) {
    if (mode_ == RunMode::threaded) to_frontend_.push(std::move(*packet));
    else if (failure_.empty()) failure_ = failure_of([&] { track(std::move(*packet)); });
  }
}

void System::track(SensorPacket packet) {
  TrackedFrame frame = frontend_->process(packet, feedback_for(packet.id));
  if (on_keyframe_ || loop_) frame.images = std::move(packet.frame);
  if (mode_ == RunMode::threaded) to_estimator_.push(std::move(frame));
  else estimate(frame);
}

void System::estimate(const TrackedFrame& frame) {
  if (on_tracked_frame_) on_tracked_frame_(frame);
  Estimate estimate = estimator_.process(frame);
  publish(frame.id, estimator_.prior(), std::move(estimate.landmarks));
  if (on_odometry_) on_odometry_(estimate.odometry);
  hand_on(estimate);
}

void System::hand_on(const Estimate& estimate) {
  for (const Keyframe& keyframe : estimate.keyframes) {
    if (on_keyframe_) on_keyframe_(keyframe);
    if (!loop_) continue;
    LoopTask task{keyframe, FrameId{estimate.odometry.id.value + 1}};
    if (mode_ == RunMode::threaded) to_loop_.push(std::move(task));
    else close_loops(task);
  }
}

void System::close_loops(const LoopTask& task) {
  MapUpdate update = loop_->process(task.keyframe);
  update.applies_from = task.applies_from;
  if (on_map_update_) on_map_update_(update);
}

/// The state that this frame's prediction starts from; the frontend has been told of all landmarks up to then.
StatePrior System::feedback_for(FrameId frame) {
  const std::int64_t wanted = frame.value - kPriorLag;
  if (wanted < 0) return {};
  std::unique_lock lock(prior_mutex_);
  prior_published_.wait(lock, [&] { return stopped_ || frames_estimated_ > wanted; });
  for (; !landmark_updates_.empty() && landmark_updates_.front().sequence <= wanted; landmark_updates_.pop_front())
    frontend_->locate(landmark_updates_.front());
  return priors_[wanted % priors_.size()];
}

void System::publish(FrameId frame, const StatePrior& prior, LandmarkUpdate landmarks) {
  const std::lock_guard lock(prior_mutex_);
  landmark_updates_.push_back(std::move(landmarks));
  priors_[frame.value % priors_.size()] = prior;
  frames_estimated_ = frame.value + 1;
  prior_published_.notify_all();
}

void System::stop_waiting() {
  to_frontend_.close();
  to_estimator_.close();
  to_loop_.close();
  const std::lock_guard lock(prior_mutex_);
  stopped_ = true;
  prior_published_.notify_all();
}

Result<void> System::finish() {
  if (finished_) return {};
  finished_ = true;
  forward_packets(true);
  to_frontend_.close();
  // Both have ended before this returns, whichever failed: no callback comes later.
  for (StageRunner* runner : {&frontend_runner_, &estimator_runner_, &loop_runner_}) {
    const std::string failure = runner->join();
    if (failure_.empty()) failure_ = failure;
  }
  if (failure_.empty()) return {};
  return Error{ErrorCode::invalid_argument, failure_};
}

}  // namespace fbvins
