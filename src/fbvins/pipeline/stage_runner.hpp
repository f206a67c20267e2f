// SPDX-License-Identifier: Apache-2.0
// The only owner of threads: runs one function on a thread of its own until it returns, and keeps
// the sentence of a foreign exception instead of letting it end the program.
#pragma once

#include <exception>
#include <functional>
#include <string>
#include <thread>

namespace fbvins {

class StageRunner {
 public:
  /// `body` runs until its queue is closed; `on_failure` must close the queues that others wait on.
  void start(std::function<void()> body, std::function<void()> on_failure) {
    thread_ = std::thread([this, body = std::move(body), on_failure = std::move(on_failure)] {
      try {
        body();
      } catch (const std::exception& e) {
        failure_ = e.what();
        on_failure();
      }
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
