// SPDX-License-Identifier: Apache-2.0
// The flight record: the estimator's inputs and results, in an MCAP file. If the program is killed, the file is readable up to a
// tenth of a second before (docs/flight_record.md). `fbvins run` takes such a file as a recording.
//
//   auto record = RecordSink::create("flight.mcap", source->rig(), {.configuration = to_yaml(config)});
//   live->add_sink(std::move(*record));
//
// The record ends, whole, while there is still space on the disk for what matters more (maps, the IMU's state).
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "fbvins/io/flight_record.hpp"
#include "fbvins/live/sink.hpp"

namespace fbvins {

/// Bytes that this program may still write to a file's disk.
std::uint64_t free_bytes_beside(const std::string& path);

struct RecordSpace {
  std::uint64_t keep_free_bytes = 256'000'000;  ///< with less free space the record ends
  std::function<std::uint64_t(const std::string& path)> free_bytes = free_bytes_beside;
};

class RecordSink final : public Sink {
 public:
  /// An error if the file exists already, or cannot be created.
  static Result<std::unique_ptr<RecordSink>> create(const std::string& path, const StereoRig& rig,
                                                    const FlightRecordOptions& options, RecordSpace space = {});
  /// Where the file exists already: flight-2.mcap, flight-3.mcap ...
  static Result<std::unique_ptr<RecordSink>> create_next(const std::string& path, const StereoRig& rig,
                                                         const FlightRecordOptions& options, const RecordSpace& space = {});
  RecordSink(const RecordSink&) = delete;
  RecordSink& operator=(const RecordSink&) = delete;
  ~RecordSink() override;

  std::string_view name() const override { return name_; }
  bool wants_views() const override { return true; }
  Result<void> take(const LiveEvent& event) override;
  /// The file, its size, and what is free on its disk, as of the last flush.
  std::vector<OutputFigure> figures() const override;
  Result<void> finish() override;
  const std::string& path() const { return path_; }

 private:
  RecordSink(std::string path, FlightRecord record, RecordSpace space);
  void keep_flushing();
  void measure();
  void end_if_disk_is_full();
  void stop_flushing();

  std::string path_, name_;
  RecordSpace space_;
  std::mutex mutex_;
  std::condition_variable ending_;
  FlightRecord record_;   // guarded by mutex_, but for sync()
  Result<void> flushed_;  // guarded by mutex_
  bool ended_ = false;    // guarded by mutex_
  bool whole_ = false;    // guarded by mutex_; nothing more is taken
  std::atomic<std::uint64_t> free_bytes_, written_bytes_{0};
  std::thread flusher_;
};

}  // namespace fbvins
