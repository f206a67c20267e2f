// SPDX-License-Identifier: Apache-2.0
// The only owner of threads: runs one function on a thread of its own until it returns, and keeps
// the sentence of a foreign exception instead of letting it end the program.
#pragma once

#include <exception>
#include <functional>
#include <string>
#include <thread>

namespace fbvins {

/// Runs `body`; the sentence of the exception it ended with, or empty.
template <class Body>
std::string failure_of(Body&& body) {
  try {
    body();
    return {};
  } catch (const std::exception& e) {
    return std::string("a stage failed: ") + e.what();
  } catch (...) {
    return "a stage failed with an unknown exception";
  }
}

class StageRunner {
 public:
  /// `body` runs until its queue is closed; `on_failure` must close the queues that others wait on.
  void start(std::function<void()> body, std::function<void()> on_failure) {
    thread_ = std::thread([this, body = std::move(body), on_failure = std::move(on_failure)] {
      failure_ = failure_of(body);
      if (!failure_.empty()) on_failure();
    });
  }

  /// Waits for the end; the sentence of an exception, or empty.
  std::string join() {
    if (thread_.joinable()) thread_.join();
    return failure_;
  }

  ~StageRunner() { join(); }

 private:
  std::thread thread_;
  std::string failure_;
};

}  // namespace fbvins
