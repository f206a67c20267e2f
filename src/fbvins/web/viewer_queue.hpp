// SPDX-License-Identifier: Apache-2.0
// Private: a viewer's queue. When it is full the oldest image is dropped, or else the oldest message. One thread.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <utility>

namespace fbvins {

/// Encoded once, shared by all viewers.
struct WebMessage {
  std::string bytes;
  bool binary = false;
  bool image = false;  ///< large, and soon followed by a newer one
};
using SharedMessage = std::shared_ptr<const WebMessage>;

class ViewerQueue {
 public:
  struct Limits {
    std::size_t messages = 128;
    std::size_t images = 2;
  };

  ViewerQueue() = default;
  explicit ViewerQueue(Limits limits) : limits_(limits) {}

  void push(SharedMessage message) {
    if (message->image && ++images_ > limits_.images) drop(oldest_image());
    if (queue_.size() >= limits_.messages) drop(images_ > 0 ? oldest_image() : queue_.begin());
    queue_.push_back(std::move(message));
  }
  SharedMessage pop() {
    if (queue_.empty()) return nullptr;
    SharedMessage message = std::move(queue_.front());
    queue_.pop_front();
    if (message->image) --images_;
    return message;
  }
  std::size_t size() const { return queue_.size(); }
  std::int64_t dropped() const { return dropped_; }

 private:
  using Place = std::deque<SharedMessage>::iterator;
  Place oldest_image() {
    return std::find_if(queue_.begin(), queue_.end(), [](const SharedMessage& m) { return m->image; });
  }
  void drop(Place place) {
    if (place == queue_.end()) return;
    if ((*place)->image) --images_;
    queue_.erase(place);
    ++dropped_;
  }

  Limits limits_{};
  std::deque<SharedMessage> queue_;
  std::size_t images_ = 0;
  std::int64_t dropped_ = 0;
};

}  // namespace fbvins
