// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/ingest.hpp"

#include <algorithm>
#include <utility>

namespace fbvins {

Ingest::Ingest(const LiveOptions& options, double clock_rate, Clock now, OnReading on_reading)
    : now_(std::move(now)),
      on_reading_(std::move(on_reading)),
      clock_(clock_rate),
      order_(Duration::from_seconds(options.imu_reorder_wait_s)) {}

void Ingest::push(const ImuSample& sample) {
  const std::lock_guard order(order_mutex_);
  const Time host = now_();
  ImuSample mended = sample;
  mended.t = clock_.mend(ClockGuard::imu, sample.t, host);
  ++counts_.imu;
  arrivals_.imu = host;
  arrivals_.newest = std::max(arrivals_.newest, mended.t);
  order_.push(mended, host, [&](const ImuSample& s) { release(s); });
}

void Ingest::push(StereoFrame frame) {
  {
    const std::lock_guard order(order_mutex_);
    const Time host = now_();
    frame.t = clock_.mend(ClockGuard::camera, frame.t, host);
    if (frozen_[0].is_repeated(frame.left)) frame.left.reset();
    if (frozen_[1].is_repeated(frame.right)) frame.right.reset();
    ++counts_.images;
    if (frame.left == nullptr || frame.right == nullptr) ++counts_.images_incomplete;
    if (frame.left != nullptr) arrivals_.left = host;
    if (frame.right != nullptr) arrivals_.right = host;
    if (frame.left != nullptr || frame.right != nullptr) arrivals_.image = host;
    arrivals_.newest = std::max(arrivals_.newest, frame.t);
  }
  const std::lock_guard lock(mutex_);
  if (closed_) return;
  if (image_waits_) drop_waiting_image();
  queue_.push_back(std::move(frame));
  image_waits_ = true;
  filled_.notify_one();
}

void Ingest::tick() {
  const std::lock_guard order(order_mutex_);
  order_.tick(now_(), [&](const ImuSample& s) { release(s); });
}

void Ingest::release(const ImuSample& sample) {
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    queue_.push_back(sample);
    filled_.notify_one();
  }
  if (on_reading_) on_reading_(sample, clock_.host_of(sample.t));
}

void Ingest::drop_waiting_image() {
  const auto waiting = std::find_if(queue_.begin(), queue_.end(),
                                    [](const SensorEvent& event) { return std::holds_alternative<StereoFrame>(event); });
  queue_.erase(waiting);
  ++images_dropped_;
}

std::optional<SensorEvent> Ingest::pop() {
  std::unique_lock lock(mutex_);
  filled_.wait(lock, [&] { return closed_ || !queue_.empty(); });
  if (queue_.empty()) return std::nullopt;
  SensorEvent event = std::move(queue_.front());
  queue_.pop_front();
  if (std::holds_alternative<StereoFrame>(event)) image_waits_ = false;
  return event;
}

void Ingest::close() {
  {
    const std::lock_guard order(order_mutex_);
    order_.flush([&](const ImuSample& s) { release(s); });
  }
  const std::lock_guard lock(mutex_);
  closed_ = true;
  filled_.notify_all();
}

Ingest::Arrival Ingest::arrivals() const {
  const std::lock_guard order(order_mutex_);
  return arrivals_;
}

Time Ingest::host_of(Time t) const {
  const std::lock_guard order(order_mutex_);
  return clock_.host_of(t);
}

LiveCounts Ingest::counts() const {
  const std::lock_guard order(order_mutex_);
  LiveCounts counts = counts_;
  counts.imu_late = order_.late();
  counts.imu_reordered = order_.reordered();
  counts.clock_leaps = clock_.leaps();
  const std::lock_guard lock(mutex_);
  counts.images_dropped = images_dropped_;
  return counts;
}

}  // namespace fbvins
