// SPDX-License-Identifier: Apache-2.0
#include "apps/file_writer.hpp"

#include <cassert>
#include <utility>

namespace fbvins::app {

FileWriter::FileWriter(WriteFile write) : write_(std::move(write)), thread_([this] { work(); }) {}

FileWriter::~FileWriter() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    given_.notify_one();
  }
  thread_.join();
}

void FileWriter::write(std::string path, std::string bytes, Told told) {
  assert(idle_);
  idle_ = false;
  path_ = std::move(path), bytes_ = std::move(bytes), told_ = std::move(told);
  const std::lock_guard lock(mutex_);
  has_work_ = true;
  given_.notify_one();
}

void FileWriter::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    given_.wait(lock, [&] { return has_work_ || ended_; });
    if (!has_work_) return;
    has_work_ = false;
    lock.unlock();
    told_(write_(path_, bytes_));
    bytes_ = {};
    idle_ = true;
    idle_.notify_all();
    lock.lock();
  }
}

}  // namespace fbvins::app
