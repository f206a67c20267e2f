// SPDX-License-Identifier: Apache-2.0
// A flight record that may begin and end during the flight, again and again.
//
//   auto record = std::make_unique<RecordSwitch>([=] { return RecordSink::create_next(path, rig, options); });
//   Result<std::string> began = record->start();     // the file's path
//   live->add_sink(std::move(record));
//   Result<std::string> ended = ...->stop();
//
// Threads: start(), stop(), problem() and figures() from any. The last two never wait for the disk: the estimator's thread asks.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "fbvins/live/record_sink.hpp"

namespace fbvins {

class RecordSwitch final : public Sink {
 public:
  using Open = std::function<Result<std::unique_ptr<RecordSink>>()>;
  explicit RecordSwitch(Open open) : open_(std::move(open)) {}

  /// Begins a file; an error while another one is being written, or where it cannot be opened. The path.
  Result<std::string> start();
  /// Ends the file, whole; an error where none is being written. The path.
  Result<std::string> stop();

  std::string_view name() const override { return "record"; }
  bool wants_views() const override { return on_; }
  Result<void> take(const LiveEvent& event) override;
  /// Why no record could be begun, until one can.
  std::string problem() const override;
  std::vector<OutputFigure> figures() const override;
  Result<void> finish() override;

 private:
  std::shared_ptr<RecordSink> record() const;
  std::shared_ptr<RecordSink> exchange(std::shared_ptr<RecordSink> record, std::string problem);

  Open open_;
  std::mutex changing_;                 // held by start() and stop(), which wait for the disk
  mutable std::mutex mutex_;            // guards the next two, and is held while they are copied
  std::shared_ptr<RecordSink> record_;  // null: none is being written
  std::string problem_;
  std::atomic<bool> on_{false};
};

}  // namespace fbvins
