// SPDX-License-Identifier: Apache-2.0
#include "fbvins/core/bounded_queue.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

namespace fbvins {
namespace bounded_queue_test {

TEST(BoundedQueue, KeepsOrderAndNeverHoldsMoreThanItsCapacity) {
  constexpr int kValues = 2000, kCapacity = 3;
  BoundedQueue<int> queue(kCapacity);
  std::atomic<int> pushed{0};
  std::thread producer([&] {
    for (int i = 0; i < kValues; ++i) {
      EXPECT_TRUE(queue.push(i));
      pushed.store(i + 1);
    }
    queue.close();
  });
  std::vector<int> received;
  while (auto value = queue.pop()) {
    received.push_back(*value);
    // Completed pushes are those received and those held.
    EXPECT_LE(pushed.load(), static_cast<int>(received.size()) + kCapacity);
  }
  producer.join();
  ASSERT_EQ(received.size(), kValues);
  for (int i = 0; i < kValues; ++i) ASSERT_EQ(received[i], i);
}

TEST(BoundedQueue, IsDrainedAfterClosing) {
  BoundedQueue<int> queue(4);
  queue.push(1);
  queue.push(2);
  queue.close();
  EXPECT_FALSE(queue.push(3));
  EXPECT_EQ(queue.pop(), 1);
  EXPECT_EQ(queue.pop(), 2);
  EXPECT_EQ(queue.pop(), std::nullopt);
  EXPECT_EQ(queue.pop(), std::nullopt);
}

TEST(BoundedQueue, ClosingWakesAWaitingPush) {
  BoundedQueue<int> queue(1);
  ASSERT_TRUE(queue.push(1));
  bool accepted = true;
  std::thread producer([&] { accepted = queue.push(2); });
  queue.close();
  producer.join();
  EXPECT_FALSE(accepted);
}

TEST(BoundedQueue, ClosingWakesAWaitingPop) {
  BoundedQueue<int> queue(1);
  std::optional<int> value = 7;
  std::thread consumer([&] { value = queue.pop(); });
  queue.close();
  consumer.join();
  EXPECT_EQ(value, std::nullopt);
}

TEST(BoundedQueue, CarriesValuesThatOnlyMove) {
  BoundedQueue<std::unique_ptr<int>> queue(2);
  queue.push(std::make_unique<int>(5));
  auto value = queue.pop();
  ASSERT_TRUE(value && *value);
  EXPECT_EQ(**value, 5);
}

}  // namespace bounded_queue_test
}  // namespace fbvins
