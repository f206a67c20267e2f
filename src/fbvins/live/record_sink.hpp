// SPDX-License-Identifier: Apache-2.0
// The flight record: the estimator's inputs and results, in an MCAP file. If the program is killed, the file is readable up to a
// tenth of a second before (docs/flight_record.md). `fbvins run` takes such a file as a recording.
//
//   auto record = RecordSink::create("flight.mcap", source->rig(), {.configuration = to_yaml(config)});
//   live->add_sink(std::move(*record));
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "fbvins/io/flight_record.hpp"
#include "fbvins/live/sink.hpp"

namespace fbvins {

class RecordSink final : public Sink {
 public:
  /// An error if the file exists already, or cannot be created.
  static Result<std::unique_ptr<RecordSink>> create(const std::string& path, const StereoRig& rig,
                                                    const FlightRecordOptions& options);
  RecordSink(const RecordSink&) = delete;
  RecordSink& operator=(const RecordSink&) = delete;
  ~RecordSink() override;

  std::string_view name() const override { return name_; }
  bool wants_views() const override { return true; }
  Result<void> take(const LiveEvent& event) override;
  Result<void> finish() override;

 private:
  RecordSink(const std::string& path, FlightRecord record);
  void keep_flushing();
  void stop_flushing();

  std::string name_;
  std::mutex mutex_;
  std::condition_variable ending_;
  FlightRecord record_;   // guarded by mutex_, but for sync()
  Result<void> flushed_;  // guarded by mutex_
  bool ended_ = false;    // guarded by mutex_
  std::thread flusher_;
};

}  // namespace fbvins
