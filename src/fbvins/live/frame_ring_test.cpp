// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/frame_ring.hpp"

#include <gtest/gtest.h>

#include "tests/support/socket_test_sender.hpp"

namespace fbvins {
namespace frame_ring_test {

using test::kSlotBytes;

const FrameLayout kLayout{test::kWidth, test::kHeight, test::kSlots, kSlotBytes, 2, {0, kSlotBytes / 2}};

bool rings(const WakeEvent& wake) {
  pollfd watched{wake.fd(), POLLIN, 0};
  return ::poll(&watched, 1, 0) == 1;
}

class FrameRingTest : public testing::Test {
 protected:
  FrameRingTest() {
    slots_ =
        static_cast<std::uint8_t*>(::mmap(nullptr, kLayout.bytes(), PROT_READ | PROT_WRITE, MAP_SHARED, memory_.number(), 0));
    for (std::size_t i = 0; i < kLayout.bytes(); ++i) slots_[i] = static_cast<std::uint8_t>(i * 7 + i / kSlotBytes);
    auto ring = FrameRing::map(memory_, kLayout, wake_);
    EXPECT_TRUE(ring);
    if (ring) ring_ = *ring;
  }
  ~FrameRingTest() override { ::munmap(slots_, kLayout.bytes()); }

  FileDescriptor memory_ = test::test_memory();
  std::shared_ptr<const WakeEvent> wake_ = std::make_shared<const WakeEvent>();
  std::shared_ptr<FrameRing> ring_;
  std::uint8_t* slots_ = nullptr;
};

SocketFrame frame_in(int slot) { return {{1000 + slot}, 0, slot, 0b11}; }

TEST_F(FrameRingTest, FramesAreTheSendersMemory) {
  const auto frame = ring_->take(frame_in(2));
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->t, Time{1002});
  EXPECT_TRUE(frame->left()->foreign());
  EXPECT_EQ(std::memcmp(frame->left()->row(0), slots_ + 2 * kSlotBytes, kLayout.image_bytes()), 0);
  EXPECT_EQ(std::memcmp(frame->right()->row(0), slots_ + 2 * kSlotBytes + kSlotBytes / 2, kLayout.image_bytes()), 0);
  slots_[2 * kSlotBytes] = 123;  // the same memory, not a copy
  EXPECT_EQ(frame->left()->at(0, 0), 123);
}

TEST_F(FrameRingTest, ImagesOfThreeCamerasInOneSlot) {
  FrameLayout layout = kLayout;
  layout.cameras = 3;
  layout.offset_bytes[2] = kSlotBytes - layout.image_bytes();
  auto ring = FrameRing::map(memory_, layout, wake_);
  ASSERT_TRUE(ring);
  SocketFrame sent = frame_in(1);
  sent.images = 0b101;
  sent.offsets.set(2, Duration{7});
  const auto frame = (*ring)->take(sent);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->right(), nullptr);
  ASSERT_EQ(frame->images.size(), 3u);
  EXPECT_EQ(std::memcmp(frame->images[2]->row(0), slots_ + 2 * kSlotBytes - layout.image_bytes(), layout.image_bytes()), 0);
  EXPECT_EQ(frame->offsets.of(2), Duration{7});
  sent.slot = 2, sent.images = 0b1000;
  const auto beyond = (*ring)->take(sent);
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().message, "frame: images of more than the 3 cameras of the hello");
}

TEST_F(FrameRingTest, ADepthImageBesideThatOfTheCamera) {
  FrameLayout layout = kLayout;
  layout.cameras = 1;
  layout.slot_bytes = 2 * kSlotBytes, layout.slots = 2;
  layout.depth_offset_bytes = kSlotBytes;
  layout.depth_width_px = 40, layout.depth_height_px = 30;
  auto ring = FrameRing::map(memory_, layout, wake_);
  ASSERT_TRUE(ring);
  SocketFrame sent = frame_in(1);
  sent.images = FBVINS_SOCKET_LEFT | FBVINS_SOCKET_DEPTH;
  const auto frame = (*ring)->take(sent);
  ASSERT_TRUE(frame);
  EXPECT_NE(frame->left(), nullptr);
  ASSERT_NE(frame->depth, nullptr);
  std::uint16_t last = 0;
  std::memcpy(&last, slots_ + 3 * kSlotBytes + 2 * layout.depth_values() - 2, 2);
  EXPECT_EQ(frame->depth->mm.size(), 40u * 30u);
  EXPECT_EQ(frame->depth->row(29)[39], last);
  sent.slot = 0, sent.images = FBVINS_SOCKET_LEFT;
  EXPECT_EQ((*ring)->take(sent)->depth, nullptr);
}

TEST_F(FrameRingTest, ASlotIsFreeWhenItsLastImageIsGone) {
  auto frame = ring_->take(frame_in(1));
  ASSERT_TRUE(frame);
  EXPECT_EQ(ring_->held(), 1);
  std::shared_ptr<const Image> right = frame->right();
  frame->images.clear();
  EXPECT_EQ(ring_->released(), 0u);
  EXPECT_FALSE(rings(*wake_));
  EXPECT_FALSE(ring_->take(frame_in(1)));  // still held
  right.reset();
  EXPECT_TRUE(rings(*wake_));
  EXPECT_FALSE(ring_->take(frame_in(1)));  // free, but the sender does not know yet
  EXPECT_EQ(ring_->held(), 0);
  EXPECT_EQ(ring_->released(), 2u);
  EXPECT_EQ(ring_->released(), 0u);
  EXPECT_TRUE(ring_->take(frame_in(1)));
}

TEST_F(FrameRingTest, WhereSlotsAreScarceImagesAreCopied) {
  const auto first = ring_->take(frame_in(0)), second = ring_->take(frame_in(3));
  ASSERT_TRUE(first && second);
  const auto third = ring_->take(frame_in(1));
  ASSERT_TRUE(third);
  EXPECT_FALSE(third->left()->foreign());
  EXPECT_EQ(ring_->released(), 2u);
  EXPECT_EQ(third->right()->at(5, 0), slots_[kSlotBytes + kSlotBytes / 2 + 5]);
  slots_[kSlotBytes + kSlotBytes / 2 + 5] ^= 1;
  EXPECT_NE(third->right()->at(5, 0), slots_[kSlotBytes + kSlotBytes / 2 + 5]);
}

TEST_F(FrameRingTest, AMissingImageIsANullPointer) {
  const auto frame = ring_->take({{1}, 0, 0, 0b10});
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->left(), nullptr);
  ASSERT_NE(frame->right(), nullptr);
  EXPECT_EQ(frame->right()->at(0, 0), slots_[kSlotBytes / 2]);
}

TEST_F(FrameRingTest, ImagesOutliveTheRingAndItsSender) {
  const auto frame = ring_->take(frame_in(3));
  ASSERT_TRUE(frame);
  const std::uint8_t wanted = slots_[3 * kSlotBytes + 9];
  ring_.reset();
  memory_ = FileDescriptor();
  EXPECT_EQ(frame->left()->at(9, 0), wanted);
}

TEST_F(FrameRingTest, MemoryThatTheSenderTakesBackReadsAsBlack) {
  const auto frame = ring_->take(frame_in(0));
  ASSERT_TRUE(frame);
  ASSERT_EQ(::fallocate(memory_.number(), FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, 0, static_cast<off_t>(kLayout.bytes())), 0);
  EXPECT_EQ(frame->left()->at(9, 9), 0);
}

TEST_F(FrameRingTest, NoSlotBeyondTheLast) {
  const auto frame = ring_->take(frame_in(4));
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().message, "frame: no slot 4, there are 4");
}

TEST(FrameRing, MemoryThatCouldGoAwayIsRefused) {
  const auto wake = std::make_shared<const WakeEvent>();
  const auto refusal = [&](const FileDescriptor& memory) {
    const auto ring = FrameRing::map(memory, kLayout, wake);
    return ring ? "taken" : ring.error().message;
  };
  EXPECT_EQ(refusal(test::test_memory(kLayout.bytes(), F_SEAL_GROW)), "the images' memory is not sealed with F_SEAL_SHRINK");
  EXPECT_EQ(refusal(test::test_memory(kLayout.bytes() - 1)), "the images' memory has 32767 bytes where 4 slots need 32768");
  EXPECT_EQ(refusal(FileDescriptor(::eventfd(0, EFD_CLOEXEC))), "the images' memory is not a memfd that allows sealing");
  EXPECT_EQ(refusal(FileDescriptor(::open("/proc/self/status", O_RDONLY | O_CLOEXEC))),
            "the images' memory is not a memfd that allows sealing");
  const FileDescriptor good = test::test_memory();
  EXPECT_EQ(refusal(good), "taken");
  EXPECT_NE(::ftruncate(good.number(), 1), 0);  // the seal holds
}

}  // namespace frame_ring_test
}  // namespace fbvins
