// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/viewer_queue.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace viewer_queue_test {

SharedMessage text(const std::string& bytes) { return std::make_shared<const WebMessage>(WebMessage{bytes}); }
SharedMessage image(const std::string& bytes) { return std::make_shared<const WebMessage>(WebMessage{bytes, true, true}); }

std::string all(ViewerQueue& queue) {
  std::string out;
  while (const SharedMessage message = queue.pop()) out += message->bytes;
  return out;
}

TEST(ViewerQueue, DropsTheOldestImageFirstThenTheOldest) {
  ViewerQueue queue({.messages = 5, .images = 2});
  for (const char* name : {"a", "b"}) queue.push(text(name));
  for (const char* name : {"1", "2", "3"}) queue.push(image(name));
  EXPECT_EQ(queue.dropped(), 1);  // image 1
  queue.push(text("c"));
  EXPECT_EQ(queue.size(), 5u);
  queue.push(text("d"));  // for it goes image 2
  queue.push(text("e"));  // image 3
  queue.push(text("f"));  // a
  EXPECT_EQ(queue.dropped(), 4);
  EXPECT_EQ(all(queue), "bcdef");
  EXPECT_EQ(queue.pop(), nullptr);
}

TEST(ViewerQueue, KeepsTheNewestImagesOfEachCamera) {
  ViewerQueue queue({.messages = 20, .images = 2});
  for (const char* name : {"a", "b", "c"})
    for (int camera = 0; camera < 4; ++camera)
      queue.push(std::make_shared<const WebMessage>(WebMessage{name + std::to_string(camera), true, true, camera}));
  EXPECT_EQ(queue.dropped(), 4);
  EXPECT_EQ(all(queue), "b0b1b2b3c0c1c2c3");
}

}  // namespace viewer_queue_test
}  // namespace fbvins
