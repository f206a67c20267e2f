// SPDX-License-Identifier: Apache-2.0
// Writes whole files on a thread of its own, so that nobody waits for a slow disk.
//
//   FileWriter writer;
//   if (writer.idle()) writer.write("map.fbm", bytes, [](const Result<void>& written) { ... });
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "fbvins/core/atomic_file.hpp"

namespace fbvins::app {

/// One file at a time, so that the memory for waiting bytes is bounded. One thread gives the files.
class FileWriter {
 public:
  using Told = std::function<void(const Result<void>& written)>;

  explicit FileWriter(WriteFile write = write_file_atomically);
  /// Waits for the file in work.
  ~FileWriter();

  bool idle() const { return idle_; }
  /// Waits for the file in work.
  void wait() const { idle_.wait(false); }
  /// Only when idle. `told` is called on the writer's thread.
  void write(std::string path, std::string bytes, Told told);

 private:
  void work();

  WriteFile write_;
  std::string path_, bytes_;  // while not idle, the writer's thread's
  Told told_;
  std::atomic<bool> idle_{true};
  std::mutex mutex_;
  std::condition_variable given_;
  bool has_work_ = false, ended_ = false;  // guarded by mutex_
  std::thread thread_;
};

}  // namespace fbvins::app
