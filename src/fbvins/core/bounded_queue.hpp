// SPDX-License-Identifier: Apache-2.0
// A queue between two threads: push blocks when full, pop when empty; ending is close, drain, join.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>

namespace fbvins {

template <class T>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t capacity) : capacity_(capacity) {}

  /// Waits for room. False (and the value dropped) once closed.
  bool push(T value) {
    std::unique_lock lock(mutex_);
    room_.wait(lock, [&] { return closed_ || values_.size() < capacity_; });
    if (closed_) return false;
    values_.push_back(std::move(value));
    filled_.notify_one();
    return true;
  }

  /// Takes the value only if there is room, or the queue is closed, and says so; else the value is left as it was.
  bool push_if_room(T& value) {
    const std::lock_guard lock(mutex_);
    if (!closed_ && values_.size() >= capacity_) return false;
    if (!closed_) values_.push_back(std::move(value));
    filled_.notify_one();
    return true;
  }

  /// Waits for a value; nothing once closed and drained.
  std::optional<T> pop() {
    std::unique_lock lock(mutex_);
    filled_.wait(lock, [&] { return closed_ || !values_.empty(); });
    if (values_.empty()) return std::nullopt;
    T value = std::move(values_.front());
    values_.pop_front();
    room_.notify_one();
    return value;
  }

  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    room_.notify_all();
    filled_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable room_, filled_;
  std::deque<T> values_;
  std::size_t capacity_;
  bool closed_ = false;
};

}  // namespace fbvins
