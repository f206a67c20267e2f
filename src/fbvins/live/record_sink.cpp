// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/record_sink.hpp"

#include <chrono>
#include <limits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fbvins/live/live_diagnostic.hpp"

namespace fbvins {
namespace {

/// Messages are in memory only for no longer than this.
constexpr std::chrono::milliseconds kFlushPeriod{100};
/// Every so many flushes the file is synchronised with the disk, for a power failure.
constexpr int kFlushesPerSync = 10;

/// Features and landmarks, with those of the same track as one.
std::vector<RosLandmark> landmarks_of(const LiveView& view) {
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  std::vector<RosLandmark> out;
  std::unordered_map<TrackId, std::size_t> places;
  for (const LiveView::Feature& f : view.features) {
    places.emplace(f.track, out.size());
    out.push_back({static_cast<std::uint32_t>(f.track.value),
                   {kUnknown, kUnknown, kUnknown},
                   {static_cast<float>(f.pixel.x()), static_cast<float>(f.pixel.y())},
                   static_cast<float>(f.age_frames),
                   static_cast<float>(f.depth_m)});
  }
  for (const LiveView::Landmark& l : view.landmarks) {
    const auto [place, is_new] = places.emplace(l.track, out.size());
    if (is_new) out.push_back({static_cast<std::uint32_t>(l.track.value), {}, {kUnknown, kUnknown}, kUnknown, kUnknown});
    const Eigen::Vector3f p = l.p_W.cast<float>();
    out[place->second].p_W = {p.x(), p.y(), p.z()};
  }
  return out;
}

/// Adds one event to a record.
struct Adder {
  FlightRecord& record;

  template <class Event>
  Result<void> operator()(const Event& event) const {
    return record.add(event);
  }
  Result<void> operator()(const LivePose& pose) const {
    if (!pose.health.has_pose()) return {};
    return record.add_live({pose.t, pose.T_WB, pose.v_WB, pose.w_WB_B, pose.pose_covariance, pose.velocity_covariance});
  }
  Result<void> operator()(const LiveView& view) const { return record.add_landmarks(view.t, landmarks_of(view)); }
  Result<void> operator()(const LiveMark& mark) const {
    if (mark.t.ns == 0) return {};
    return record.add_mark(mark.t, mark.text);
  }
  Result<void> operator()(const LiveStatus& status) const {
    if (status.t.ns == 0) return {};  // no sensor data yet: there is no time to write it at
    return record.add_health(status.t, diagnostic_of(status));
  }
};

}  // namespace

Result<std::unique_ptr<RecordSink>> RecordSink::create(const std::string& path, const StereoRig& rig,
                                                       const FlightRecordOptions& options) {
  Result<FlightRecord> record = FlightRecord::create(path, rig, options);
  if (!record) return record.error();
  return std::unique_ptr<RecordSink>(new RecordSink(path, *std::move(record)));
}

RecordSink::RecordSink(const std::string& path, FlightRecord record) : name_("record " + path), record_(std::move(record)) {
  flusher_ = std::thread([this] { keep_flushing(); });
}

RecordSink::~RecordSink() { stop_flushing(); }

Result<void> RecordSink::take(const LiveEvent& event) {
  const std::lock_guard lock(mutex_);
  Result<void> flushed = std::exchange(flushed_, {});
  Result<void> added = std::visit(Adder{record_}, event);
  return flushed ? added : flushed;
}

Result<void> RecordSink::finish() {
  stop_flushing();
  return record_.finish();
}

/// On a thread, so that messages reach the file even when no more events come.
void RecordSink::keep_flushing() {
  std::unique_lock lock(mutex_);
  for (int i = 1; !ending_.wait_for(lock, kFlushPeriod, [&] { return ended_; }); ++i) {
    if (Result<void> flushed = record_.flush(); !flushed) flushed_ = flushed;
    if (i % kFlushesPerSync != 0) continue;
    lock.unlock();  // a slow disk does not hold up the writing
    record_.sync();
    lock.lock();
  }
}

void RecordSink::stop_flushing() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    ending_.notify_all();
  }
  if (flusher_.joinable()) flusher_.join();
}

}  // namespace fbvins
