// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/record_switch.hpp"

#include <utility>

namespace fbvins {

std::shared_ptr<RecordSink> RecordSwitch::record() const {
  const std::lock_guard lock(mutex_);
  return record_;
}

std::shared_ptr<RecordSink> RecordSwitch::exchange(std::shared_ptr<RecordSink> record, std::string problem) {
  const std::lock_guard lock(mutex_);
  problem_ = std::move(problem);
  on_ = record != nullptr;
  return std::exchange(record_, std::move(record));
}

Result<std::string> RecordSwitch::start() {
  const std::lock_guard lock(changing_);
  if (const auto current = record()) return Error{ErrorCode::invalid_argument, "a record is being written: " + current->path()};
  auto opened = open_();
  if (!opened) {
    exchange(nullptr, opened.error().message);
    return opened.error();
  }
  std::string path = (*opened)->path();
  exchange(std::move(*opened), "");
  return path;
}

/// What take() hands to the record while it ends comes too late for it.
Result<std::string> RecordSwitch::stop() {
  const std::lock_guard lock(changing_);
  const std::shared_ptr<RecordSink> ended = exchange(nullptr, problem());
  if (!ended) return Error{ErrorCode::invalid_argument, "no record is being written"};
  if (Result<void> done = ended->finish(); !done) return done.error();
  return ended->path();
}

Result<void> RecordSwitch::take(const LiveEvent& event) {
  const auto current = record();
  return current ? current->take(event) : Result<void>{};
}

std::string RecordSwitch::problem() const {
  const std::lock_guard lock(mutex_);
  return problem_;
}

std::vector<OutputFigure> RecordSwitch::figures() const {
  const auto current = record();
  std::vector<OutputFigure> figures{{"recording", current != nullptr}};
  if (current)
    for (OutputFigure& figure : current->figures()) figures.push_back(std::move(figure));
  return figures;
}

Result<void> RecordSwitch::finish() {
  on_ = false;
  const std::lock_guard lock(changing_);
  const auto current = record();
  return current ? current->finish() : Result<void>{};
}

}  // namespace fbvins
