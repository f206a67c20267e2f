// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/estimator_link.hpp"

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>

namespace fbvins {
namespace {

/// A failed stage is noticed within this time.
constexpr std::chrono::milliseconds kLook{50};

}  // namespace

struct EstimatorLink::Impl {
  explicit Impl(System s) : system(std::move(s)) {}

  System system;
  std::mutex mutex;
  std::condition_variable arrived;
  std::deque<Time> asked;  ///< images pushed and not yet answered
  std::deque<Odometry> odometry;
  std::deque<FrameId> keyframes;  ///< without an answer of the mapper yet: the frame from which it will apply
  std::deque<MapUpdate> updates;
  FrameId newest{-1};

  /// Waits until `ready`; false if a stage has failed. Call with the mutex held.
  bool complete(std::unique_lock<std::mutex>& lock, const std::function<bool()>& ready) {
    while (!ready()) {
      if (!system.status()) return false;
      arrived.wait_for(lock, kLook);
    }
    return true;
  }
};

Result<std::unique_ptr<OdometryLink>> EstimatorLink::create(const EstimatorSetup& setup, const StereoRig& rig) {
  Result<System> system = System::create(setup.options, rig, setup.mode, {.mapper = setup.mapper});
  if (!system) return system.error();
  auto impl = std::make_unique<Impl>(std::move(*system));
  Impl* link = impl.get();
  if (setup.on_tracked_frame) link->system.on_tracked_frame(setup.on_tracked_frame);
  link->system.on_odometry([link](const Odometry& o) {
    const std::lock_guard lock(link->mutex);
    link->newest = o.id;
    link->odometry.push_back(o);
    link->arrived.notify_all();
  });
  if (setup.mapper != nullptr) {
    link->system.on_keyframe([link](const Keyframe&) {
      const std::lock_guard lock(link->mutex);
      link->keyframes.push_back(FrameId{link->newest.value + 1});
    });
    link->system.on_map_update([link](const MapUpdate& update) {
      const std::lock_guard lock(link->mutex);
      link->keyframes.pop_front();
      link->updates.push_back(update);
      link->arrived.notify_all();
    });
  }
  return std::unique_ptr<OdometryLink>(new EstimatorLink(std::move(impl)));
}

EstimatorLink::EstimatorLink(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
EstimatorLink::~EstimatorLink() = default;

Result<void> EstimatorLink::push(SensorEvent event) {
  if (const auto* frame = std::get_if<StereoFrame>(&event)) impl_->asked.push_back(frame->t);
  return impl_->system.push(std::move(event));
}

Result<std::vector<KnownEstimate>> EstimatorLink::known_at(Time newest_image) {
  std::vector<KnownEstimate> known;
  Impl& link = *impl_;
  std::unique_lock lock(link.mutex);
  while (!link.asked.empty() && link.asked.front() <= newest_image) {
    if (!link.complete(lock, [&] { return !link.odometry.empty(); })) return link.system.status().error();
    KnownEstimate estimate;
    estimate.odometry = link.odometry.front();
    const FrameId id = estimate.odometry.id;
    const auto mapped = [&] { return link.keyframes.empty() || link.keyframes.front() > id; };
    if (!link.complete(lock, mapped)) return link.system.status().error();
    for (; !link.updates.empty() && link.updates.front().applies_from <= id; link.updates.pop_front())
      estimate.updates.push_back(std::move(link.updates.front()));
    link.odometry.pop_front();
    link.asked.pop_front();
    known.push_back(std::move(estimate));
  }
  return known;
}

Result<void> EstimatorLink::finish() { return impl_->system.finish(); }

}  // namespace fbvins
