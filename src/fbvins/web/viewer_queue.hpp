// SPDX-License-Identifier: Apache-2.0
// Private: a viewer's queue. When it is full the oldest image is dropped, or else the oldest message; of each camera few wait.
// One thread.
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
  int camera = 0;      ///< of an image
};
using SharedMessage = std::shared_ptr<const WebMessage>;

class ViewerQueue {
 public:
  struct Limits {
    std::size_t messages = 128;
    std::ptrdiff_t images = 2;  ///< of each camera
  };

  ViewerQueue() = default;
  explicit ViewerQueue(Limits limits) : limits_(limits) {}

  void push(SharedMessage message) {
    const auto is_like = [&](const SharedMessage& m) { return m->image && m->camera == message->camera; };
    if (message->image && std::ranges::count_if(queue_, is_like) >= limits_.images) drop(std::ranges::find_if(queue_, is_like));
    if (queue_.size() >= limits_.messages) {
      const auto image = std::ranges::find_if(queue_, [](const SharedMessage& m) { return m->image; });
      drop(image != queue_.end() ? image : queue_.begin());
    }
    queue_.push_back(std::move(message));
  }
  SharedMessage pop() {
    if (queue_.empty()) return nullptr;
    SharedMessage message = std::move(queue_.front());
    queue_.pop_front();
    return message;
  }
  std::size_t size() const { return queue_.size(); }
  std::int64_t dropped() const { return dropped_; }

 private:
  using Place = std::deque<SharedMessage>::iterator;
  void drop(Place place) {
    if (place == queue_.end()) return;
    queue_.erase(place);
    ++dropped_;
  }

  Limits limits_{};
  std::deque<SharedMessage> queue_;
  std::int64_t dropped_ = 0;
};

}  // namespace fbvins
