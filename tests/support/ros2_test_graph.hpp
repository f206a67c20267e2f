// SPDX-License-Identifier: Apache-2.0
// Tests' own ROS 2 graph: one node of this process, on the loopback, in a domain that depends on the process.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <condition_variable>
#include <mutex>
#include <string>
#include <vector>

#include "fbvins/ros2/ros2_node.hpp"

namespace fbvins::test {

inline std::shared_ptr<Ros2Node> node() {
  static const std::shared_ptr<Ros2Node> only = [] {
    auto joined = Ros2Node::join({.domain = 100 + static_cast<std::uint32_t>(getpid()) % 100});
    EXPECT_TRUE(joined) << (joined ? "" : joined.error().message);
    return joined ? *joined : nullptr;
  }();
  return only;
}

/// What a subscriber was given.
class Heard {
 public:
  Ros2Subscriber::OnMessage function() {
    return [this](std::string_view message, const std::shared_ptr<const void>&) {
      const std::lock_guard lock(mutex_);
      messages_.emplace_back(message);
      changed_.notify_all();
    };
  }
  bool wait_for(std::size_t count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(60), [&] { return messages_.size() >= count; });
  }
  std::vector<std::string> messages() const {
    const std::lock_guard lock(mutex_);
    return messages_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> messages_;
};

}  // namespace fbvins::test
