// SPDX-License-Identifier: Apache-2.0
// The owner of the stages' threads: runs one function on a thread of its own until it returns. An exception in a stage ends
// neither the thread nor the program; it becomes the status that the caller sees.
#pragma once

#include <exception>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "fbvins/core/result.hpp"

namespace fbvins {

/// The first failure of any stage; later ones are ignored. Any thread.
class StageStatus {
 public:
  void fail(Error error) {
    const std::lock_guard lock(mutex_);
    if (status_) status_ = std::move(error);
  }
  Result<void> get() const {
    const std::lock_guard lock(mutex_);
    return status_;
  }

 private:
  mutable std::mutex mutex_;
  Result<void> status_;
};

/// Runs one step of a stage; an exception becomes ErrorCode::stage_failed with the stage's name.
template <class Body>
Result<void> guarded(const char* stage, Body&& body) {
  const auto failed = [&](const std::string& why) {
    return Error{ErrorCode::stage_failed, std::string(stage) + " failed: " + why};
  };
  try {
    body();
    return {};
  } catch (const std::exception& e) {
    return failed(e.what());
  } catch (...) {
    return failed("an exception that is not a std::exception");
  }
}

class StageRunner {
 public:
  /// `body` runs until its queue is closed, and throws nothing.
  void start(std::function<void()> body) { thread_ = std::thread(std::move(body)); }

  /// Waits for the end.
  void join() {
    if (thread_.joinable()) thread_.join();
  }

  ~StageRunner() { join(); }

 private:
  std::thread thread_;
};

}  // namespace fbvins
