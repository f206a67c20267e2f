// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/ingest.hpp"

#include <algorithm>
#include <utility>

namespace fbvins {

namespace {

/// Readings kept until it is known whether their stamps are good.
constexpr std::size_t kMostMisfits = 2000;
/// Longest wait for a missing reading.
constexpr Duration kReorderWait{10'000'000};
/// Anchors that wait for the next event; more come from a sensor gone mad.
constexpr std::size_t kMostAnchors = 1024;
/// An image that repeats the one before is the same one, come twice, if its stamp is no later than this; otherwise the camera is
/// frozen.
constexpr Duration kSameImage{10'000'000};

}  // namespace

Ingest::Ingest(double clock_rate, Clock now, OnReading on_reading, const ImuNoise& imu, Duration time_offset, int cameras)
    : now_(std::move(now)),
      on_reading_(std::move(on_reading)),
      time_offset_(time_offset),
      clock_(clock_rate),
      order_(kReorderWait),
      judge_(imu),
      cameras_(static_cast<std::size_t>(cameras)) {
  arrivals_.cameras.resize(cameras_.size());
}

void Ingest::push(const ImuSample& sample) {
  const std::lock_guard order(order_mutex_);
  const Time host = now_();
  ++counts_.imu;
  if (!judge_.plausible(sample)) {
    ++counts_.imu_refused;
    return;
  }
  const std::optional<ClockGuard::Event> event = clock_.correct(ClockGuard::imu, sample.t - time_offset_, host);
  if (!event) {
    misfits_.push_back(sample);
    if (misfits_.size() <= kMostMisfits) return;
    misfits_.pop_front();
    ++counts_.imu_late;
    return;
  }
  note_clock(*event, host);
  const std::size_t lost = misfits_.size() - std::min(misfits_.size(), static_cast<std::size_t>(event->held_back));
  counts_.imu_late += static_cast<std::int64_t>(lost);
  for (std::size_t k = lost; k < misfits_.size(); ++k)
    put_in_order(misfits_[k], clock_.corrected(ClockGuard::imu, misfits_[k].t - time_offset_), host);
  misfits_.clear();
  if (event->other_too && held_image_) {
    const Time t = clock_.corrected(ClockGuard::camera, held_image_->t);
    take(*std::exchange(held_image_, std::nullopt), t, host);
  }
  put_in_order(sample, event->t, host);
}

/// Both streams may tell of it; the mark is for the next image.
void Ingest::note_clock(const ClockGuard::Event& event, Time host) {
  if (event.set_back.ns <= 0) return;
  after_clock_step_ = true;
  ++counts_.clock_set_back;
  arrivals_.set_back_at = host, arrivals_.set_back = event.set_back;
}

/// `t`: the reading's stamp on the images' clock, corrected.
void Ingest::put_in_order(ImuSample sample, Time t, Time host) {
  sample.t = t + time_offset_;
  order_.push(sample, host, [&](const ImuSample& s) { release(s); });
}

void Ingest::push(StereoFrame frame) {
  const std::lock_guard order(order_mutex_);
  const Time host = now_();
  ++counts_.images;
  const std::optional<ClockGuard::Event> event = clock_.correct(ClockGuard::camera, frame.t, host);
  if (std::optional<StereoFrame> held = std::exchange(held_image_, std::nullopt)) {
    const Time t = clock_.corrected(ClockGuard::camera, held->t);
    if (event && event->held_back > 0) take(std::move(*held), t, host);
    else ++counts_.images_late;
  }
  if (!event) {
    if (newest_image_) ++counts_.images_late;
    else held_image_ = std::move(frame);
    return;
  }
  note_clock(*event, host);
  if (event->other_too && !misfits_.empty()) {
    put_in_order(misfits_.back(), clock_.corrected(ClockGuard::imu, misfits_.back().t - time_offset_), host);
    misfits_.pop_back();
  }
  take(std::move(frame), event->t, host);
}

/// `t`: the frame's stamp, corrected.
void Ingest::take(StereoFrame frame, Time t, Time host) {
  if (newest_image_ && t <= *newest_image_) {
    ++counts_.images_late;
    return;
  }
  frame.t = t;
  after_clock_step_ |= frame.after_clock_step;
  remove_frozen(frame);
  if (newest_image_ && frame.without_images() && t - *newest_image_ < kSameImage) {
    ++counts_.images_late;
    return;
  }
  if (newest_image_) image_period_.add(frame.t - *newest_image_);
  newest_image_ = frame.t;
  note_arrival(frame, host);
  const std::lock_guard lock(mutex_);
  if (closed_) return;
  if (image_waits_) drop_waiting_image();
  frame.after_clock_step = std::exchange(after_clock_step_, false);
  queue_.push_back(std::move(frame));
  image_waits_ = true;
  filled_.notify_one();
}

void Ingest::remove_frozen(StereoFrame& frame) {
  for (std::size_t i = 0; i < cameras_.size(); ++i)
    if (cameras_[i].seen.is_repeated(frame.image(static_cast<int>(i)))) frame.images[i].reset();
}

void Ingest::note_arrival(const StereoFrame& frame, Time host) {
  bool complete = true;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const bool came = frame.image(static_cast<int>(i)) != nullptr;
    complete &= came;
    if (!came) continue;
    Watched& camera = cameras_[i];
    if (camera.newest) camera.period.add(frame.t - *camera.newest);
    camera.newest = frame.t;
    arrivals_.cameras[i] = {host, camera.period.median()};
    arrivals_.image = host;
  }
  if (!complete) ++counts_.images_incomplete;
  arrivals_.image_period = image_period_.median();
  arrivals_.newest = std::max(arrivals_.newest, frame.t);
}

void Ingest::push_anchor(Anchor anchor) {
  const std::lock_guard order(order_mutex_);
  std::visit([this](auto& a) { a.t = clock_.corrected(ClockGuard::camera, a.t); }, anchor);
  const std::lock_guard lock(mutex_);
  if (closed_ || anchors_.size() >= kMostAnchors) return;
  anchors_.push_back(std::move(anchor));
}

void Ingest::push_aiding(const AidingSample& reading) {
  AidingSample corrected = reading;
  {
    const std::lock_guard order(order_mutex_);
    stamp_of(corrected) = clock_.corrected(ClockGuard::camera, stamp_of(reading));
  }
  push_corrected(std::move(corrected));
}

void Ingest::push_corrected(AidingSample reading) {
  const std::lock_guard lock(mutex_);
  if (closed_ || !impossible(reading).empty()) return;
  queue_.push_back(std::move(reading));
  filled_.notify_one();
}

std::vector<Anchor> Ingest::take_anchors() {
  const std::lock_guard lock(mutex_);
  return std::exchange(anchors_, {});
}

void Ingest::tick() {
  const std::lock_guard order(order_mutex_);
  order_.tick(now_(), [&](const ImuSample& s) { release(s); });
}

void Ingest::release(const ImuSample& sample) {
  if (!judge_.accepts(sample)) {
    ++counts_.imu_refused;
    return;
  }
  const Time t = sample.t - time_offset_;
  arrivals_.imu = now_();
  arrivals_.newest = std::max(arrivals_.newest, t);
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    queue_.push_back(sample);
    filled_.notify_one();
  }
  if (on_reading_) on_reading_(sample, clock_.host_of(t));
}

void Ingest::drop_waiting_image() {
  const auto waiting = std::find_if(queue_.begin(), queue_.end(),
                                    [](const SensorEvent& event) { return std::holds_alternative<StereoFrame>(event); });
  after_clock_step_ |= std::get<StereoFrame>(*waiting).after_clock_step;
  queue_.erase(waiting);
  ++images_dropped_;
}

std::optional<SensorEvent> Ingest::pop() {
  std::unique_lock lock(mutex_);
  filled_.wait(lock, [&] { return closed_ || !queue_.empty(); });
  return take_first();
}

std::optional<SensorEvent> Ingest::pop_waiting() {
  const std::lock_guard lock(mutex_);
  return take_first();
}

std::optional<SensorEvent> Ingest::take_first() {
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
  counts.imu_late += order_.late();
  counts.imu_reordered = order_.reordered();
  counts.clock_leaps = clock_.jumps();
  const std::lock_guard lock(mutex_);
  counts.images_dropped = images_dropped_;
  return counts;
}

}  // namespace fbvins
