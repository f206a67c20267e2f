// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/record_sink.hpp"

#include <chrono>
#include <utility>

#include "fbvins/live/live_diagnostic.hpp"

namespace fbvins {
namespace {

/// Longer than this nothing is in memory only.
constexpr std::chrono::milliseconds kFlushPeriod{100};
/// The disk itself has all that is older than this, should the power fail.
constexpr int kFlushesPerSync = 10;

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
  Result<void> operator()(const LiveStatus& status) const {
    if (status.t.ns == 0) return {};  // no sensor has spoken yet: there is no time to write it at
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

/// Events may cease, and what waits must reach the file all the same.
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
