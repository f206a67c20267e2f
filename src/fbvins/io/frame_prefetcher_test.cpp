// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/frame_prefetcher.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>

namespace fbvins {
namespace frame_prefetcher_test {

std::vector<FrameEntry> frames(int count) {
  std::vector<FrameEntry> out;
  for (int i = 0; i < count; ++i) out.push_back({Time{i}});
  return out;
}

/// Says which frame it loaded; one of them throws.
class CountingLoader : public FrameLoader {
 public:
  explicit CountingLoader(std::int64_t bad = -1) : bad_(bad) {}
  LoadedFrame load(const FrameEntry& entry) override {
    ++loaded;
    if (entry.t.ns == bad_) throw std::runtime_error("no memory for this one");
    LoadedFrame out;
    out.frame.t = entry.t;
    return out;
  }
  std::atomic<int> loaded = 0;

 private:
  std::int64_t bad_;
};

TEST(FramePrefetcher, DeliversAllInOrderWithAndWithoutAThread) {
  for (const int depth : {0, 1, 3, 100}) {
    const std::vector<FrameEntry> list = frames(20);
    CountingLoader loader;
    FramePrefetcher prefetcher(list, loader, depth);
    for (int i = 0; i < 20; ++i) {
      const auto frame = prefetcher.next();
      ASSERT_TRUE(frame);
      EXPECT_EQ(frame->frame.t.ns, i);
    }
    EXPECT_FALSE(prefetcher.next());
    EXPECT_FALSE(prefetcher.next()) << "the end stays the end";
    EXPECT_EQ(loader.loaded, 20);
  }
}

TEST(FramePrefetcher, IsNeverFurtherAheadThanItsDepth) {
  const std::vector<FrameEntry> list = frames(50);
  CountingLoader loader;
  FramePrefetcher prefetcher(list, loader, 4);
  for (int taken = 1; taken <= 50; ++taken) {
    (void)prefetcher.next();
    EXPECT_LE(loader.loaded, taken + 4 + 1) << "four wait, one is in work";
  }
}

TEST(FramePrefetcher, ADecoderThatThrowsCostsOneFrame) {
  for (const int depth : {0, 2}) {
    const std::vector<FrameEntry> list = frames(5);
    CountingLoader loader(3);
    FramePrefetcher prefetcher(list, loader, depth);
    for (int i = 0; i < 5; ++i) {
      const auto frame = prefetcher.next();
      ASSERT_TRUE(frame);
      EXPECT_EQ(of_camera(frame->cameras, 0).corrupt, i == 3 ? 1 : 0);
      EXPECT_EQ(frame->problem, i == 3 ? "frame 3: no memory for this one" : "");
      EXPECT_EQ(frame->frame.t.ns, i);
    }
  }
}

TEST(FramePrefetcher, EndsEarlyWithoutLoadingTheRest) {
  const std::vector<FrameEntry> list = frames(1000);
  CountingLoader loader;
  {
    FramePrefetcher prefetcher(list, loader, 2);
    (void)prefetcher.next();
  }
  EXPECT_LE(loader.loaded, 4);
}

}  // namespace frame_prefetcher_test
}  // namespace fbvins
