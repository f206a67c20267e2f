// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/record_switch.hpp"

#include <utility>

namespace fbvins {

Result<std::string> RecordSwitch::start() {
  const std::lock_guard lock(mutex_);
  if (record_) return Error{ErrorCode::invalid_argument, "a record is being written: " + record_->path()};
  auto opened = open_();
  problem_ = opened ? "" : opened.error().message;
  if (!opened) return opened.error();
  record_ = std::move(*opened);
  on_ = true;
  return record_->path();
}

Result<std::string> RecordSwitch::stop() {
  const std::lock_guard lock(mutex_);
  if (!record_) return Error{ErrorCode::invalid_argument, "no record is being written"};
  on_ = false;
  const std::unique_ptr<RecordSink> ended = std::exchange(record_, nullptr);
  if (Result<void> done = ended->finish(); !done) return done.error();
  return ended->path();
}

Result<void> RecordSwitch::take(const LiveEvent& event) {
  const std::lock_guard lock(mutex_);
  return record_ ? record_->take(event) : Result<void>{};
}

std::string RecordSwitch::problem() const {
  const std::lock_guard lock(mutex_);
  return problem_;
}

std::vector<OutputFigure> RecordSwitch::figures() const {
  const std::lock_guard lock(mutex_);
  std::vector<OutputFigure> figures{{"recording", record_ != nullptr}};
  if (record_)
    for (OutputFigure& figure : record_->figures()) figures.push_back(std::move(figure));
  return figures;
}

Result<void> RecordSwitch::finish() {
  on_ = false;
  const std::lock_guard lock(mutex_);
  return record_ ? record_->finish() : Result<void>{};
}

}  // namespace fbvins
