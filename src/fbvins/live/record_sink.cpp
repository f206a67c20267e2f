// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/record_sink.hpp"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <limits>
#include <string>
#include <system_error>
#include <utility>

#include "fbvins/live/live_diagnostic.hpp"
#include "fbvins/live/view_landmarks.hpp"

namespace fbvins {
namespace {

/// Messages are in memory only for no longer than this.
constexpr std::chrono::milliseconds kFlushPeriod{100};
/// Every so many flushes the file is synchronised with the disk, for a power failure.
constexpr int kFlushesPerSync = 10;

constexpr int kMostRecords = 10'000;

std::string no_space(const RecordSpace& space) {
  return fmt::format("less than {} MB are free on its disk", space.keep_free_bytes / 1'000'000);
}

/// flight.mcap, flight-2.mcap ...
std::string numbered(const std::filesystem::path& path, int number) {
  if (number == 1) return path.string();
  return (path.parent_path() / fmt::format("{}-{}{}", path.stem().string(), number, path.extension().string())).string();
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

std::uint64_t free_bytes_beside(const std::string& path) {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const std::filesystem::space_info space = std::filesystem::space(folder.empty() ? "." : folder, error);
  return error ? std::numeric_limits<std::uint64_t>::max() : space.available;
}

Result<std::unique_ptr<RecordSink>> RecordSink::create(const std::string& path, const StereoRig& rig,
                                                       const FlightRecordOptions& options, RecordSpace space) {
  if (space.free_bytes(path) < space.keep_free_bytes) return Error{ErrorCode::unwritable, path + ": " + no_space(space)};
  Result<FlightRecord> record = FlightRecord::create(path, rig, options);
  if (!record) return record.error();
  return std::unique_ptr<RecordSink>(new RecordSink(path, *std::move(record), std::move(space)));
}

Result<std::unique_ptr<RecordSink>> RecordSink::create_next(const std::string& path, const StereoRig& rig,
                                                            const FlightRecordOptions& options, const RecordSpace& space) {
  for (int number = 1; number < kMostRecords; ++number) {
    const std::string name = numbered(path, number);
    auto made = create(name, rig, options, space);
    std::error_code ignored;
    // Asked for only after a failure: another program may take the same number at the same time.
    if (made || !std::filesystem::exists(std::filesystem::symlink_status(name, ignored))) return made;
  }
  return Error{ErrorCode::unwritable, path + ": too many records with this name"};
}

RecordSink::RecordSink(std::string path, FlightRecord record, RecordSpace space)
    : path_(std::move(path)), name_("record " + path_), space_(std::move(space)), record_(std::move(record)) {
  measure();
  flusher_ = std::thread([this] { keep_flushing(); });
}

RecordSink::~RecordSink() { stop_flushing(); }

Result<void> RecordSink::take(const LiveEvent& event) {
  const std::lock_guard lock(mutex_);
  Result<void> flushed = std::exchange(flushed_, {});
  if (whole_) return flushed;
  Result<void> added = std::visit(Adder{record_}, event);
  return flushed ? added : flushed;
}

Result<void> RecordSink::finish() {
  stop_flushing();
  const std::lock_guard lock(mutex_);
  Result<void> flushed = std::exchange(flushed_, {});
  const Result<void> done = std::exchange(whole_, true) ? Result<void>{} : record_.finish();
  return flushed ? done : flushed;
}

std::vector<OutputFigure> RecordSink::figures() const {
  return {{"file", path_},
          {"written_mb", static_cast<double>(written_bytes_) * 1e-6},
          {"free_mb", static_cast<double>(free_bytes_) * 1e-6}};
}

void RecordSink::measure() {
  std::error_code error;
  free_bytes_ = space_.free_bytes(path_);
  if (const std::uintmax_t size = std::filesystem::file_size(path_, error); !error) written_bytes_ = size;
}

/// With the mutex held. The error is that of the next call, so that the status says it.
void RecordSink::end_if_disk_is_full() {
  if (whole_ || free_bytes_ >= space_.keep_free_bytes) return;
  (void)record_.finish();
  whole_ = true;
  flushed_ = Error{ErrorCode::unwritable, "the record has ended: " + no_space(space_)};
}

/// On a thread, so that messages reach the file even when no more events come.
void RecordSink::keep_flushing() {
  std::unique_lock lock(mutex_);
  for (int i = 1; !ending_.wait_for(lock, kFlushPeriod, [&] { return ended_; }); ++i) {
    if (whole_) continue;
    if (Result<void> flushed = record_.flush(); !flushed) flushed_ = flushed;
    measure();
    end_if_disk_is_full();
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
