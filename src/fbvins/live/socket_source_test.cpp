// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/socket_source.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"
#include "tests/support/socket_source_fixture.hpp"

namespace fbvins {
namespace socket_source_test {

using namespace socket_source_fixture;

TEST_F(SocketSourceTest, PositionsArriveAndImpossibleOnesAreLeftOut) {
  TestSender sender(path());
  ASSERT_EQ(sender.begin(), std::uint32_t{FBVINS_SOCKET_WELCOME});
  FbvinsSocketPosition position{};
  position.header = {FBVINS_SOCKET_POSITION, sizeof(position)};
  sender.send(test::bytes_of(position));  // without a covariance
  position.t_ns = 30, position.p_A[2] = 1.5, position.covariance_m2[5] = 0.01, position.measured = FBVINS_SOCKET_HEIGHT;
  sender.send(test::bytes_of(position));
  const std::vector<Anchor> anchors = inbox_.anchors(1);
  ASSERT_EQ(anchors.size(), 1u);
  EXPECT_EQ(stamp_of(anchors[0]), Time{30});
  EXPECT_EQ(std::get<HeightAnchor>(anchors[0]).z_A_m, 1.5);
}

TEST_F(SocketSourceTest, ReadingsAndFramesArriveAsTheyWereSent) {
  TestSender sender(path());
  ASSERT_EQ(sender.begin(), std::uint32_t{FBVINS_SOCKET_WELCOME});
  EXPECT_EQ(sender.last<FbvinsSocketWelcome>().major, FBVINS_SOCKET_MAJOR);
  const std::vector<FbvinsSocketReading> sent = {{10, {1, 2, 3}, {4, 5, 6}}, {15, {-1, -2, -3}, {0.1, 0.2, 9.8}}};
  sender.send_readings(sent);
  for (std::uint32_t i = 0; i < test::kImageBytes; ++i) sender.slot(1)[i] = static_cast<std::uint8_t>(3 * i);
  for (std::uint32_t i = 0; i < test::kImageBytes; ++i)
    sender.slot(1)[test::kSlotBytes / 2 + i] = static_cast<std::uint8_t>(5 * i);
  sender.send_frame(20, 1, 1);

  const auto readings = inbox_.readings(2);
  ASSERT_EQ(readings.size(), 2u);
  EXPECT_EQ(readings[1].t, Time{15});
  EXPECT_EQ(readings[1].gyro_radps, Vec3(-1, -2, -3));
  EXPECT_EQ(readings[1].accel_mps2, Vec3(0.1, 0.2, 9.8));
  const auto frames = inbox_.frames(1);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].t, Time{20});
  EXPECT_TRUE(frames[0].left()->foreign());
  EXPECT_EQ(frames[0].left()->at(7, 9), static_cast<std::uint8_t>(3 * (9 * test::kWidth + 7)));
  EXPECT_EQ(frames[0].right()->at(7, 9), static_cast<std::uint8_t>(5 * (9 * test::kWidth + 7)));
}

TEST_F(SocketSourceTest, SlotsComeBackWhenTheirFramesAreGone) {
  TestSender sender(path());
  ASSERT_EQ(sender.begin(), std::uint32_t{FBVINS_SOCKET_WELCOME});
  for (std::uint32_t round = 0; round < 20; ++round) {
    sender.send_frame(20 + round, round % test::kSlots, round);
    ASSERT_EQ(inbox_.frames(1).size(), 1u);
    inbox_.drop_frames();
    ASSERT_EQ(sender.answer(), std::uint32_t{FBVINS_SOCKET_RELEASED});
    EXPECT_EQ(sender.last<FbvinsSocketReleased>().slots, std::uint64_t{1} << (round % test::kSlots));
  }
}

TEST_F(SocketSourceTest, WhoeverKeepsFramesLeavesTheSenderItsSlots) {
  TestSender sender(path());
  ASSERT_EQ(sender.begin(), std::uint32_t{FBVINS_SOCKET_WELCOME});
  sender.send_frame(1, 0, 1);
  sender.send_frame(2, 1, 2);
  for (std::uint32_t round = 0; round < 10; ++round) {  // nobody lets go of any
    sender.slot(2)[0] = static_cast<std::uint8_t>(round);
    sender.send_frame(3 + round, 2, 3 + round);
    ASSERT_EQ(sender.answer(), std::uint32_t{FBVINS_SOCKET_RELEASED});
  }
  const auto frames = inbox_.frames(12);
  ASSERT_EQ(frames.size(), 12u);
  for (std::size_t round = 0; round < 10; ++round) EXPECT_EQ(frames[2 + round].left()->at(0, 0), round);
}

TEST_F(SocketSourceTest, ASenderThatCrashesIsFollowedByTheNext) {
  for (int life = 0; life < 3; ++life) {
    TestSender sender(path());
    ASSERT_EQ(sender.begin(), std::uint32_t{FBVINS_SOCKET_WELCOME});
    sender.send_frame(100 + life, 0, 1);
    sender.send_frame(200 + life, 1, 5);
    ASSERT_EQ(inbox_.frames(2 * static_cast<std::size_t>(life) + 2).size(), 2 * static_cast<std::size_t>(life) + 2);
  }  // the connection breaks while its frames are still held
  EXPECT_TRUE(inbox_.hears("tester: left without a goodbye (2 frames, 3 missed, 0 readings, 0 refused)"));
  EXPECT_EQ(inbox_.frames(6)[5].t, Time{202});
  EXPECT_EQ(inbox_.frames(6)[5].right()->at(3, 3), 0);  // its pixels are there
  expect_service();
}

TEST_F(SocketSourceTest, WhatASenderSentBeforeItsEndArrives) {
  for (int life = 0; life < 20; ++life) {
    TestSender sender(path());
    ASSERT_EQ(sender.begin(), std::uint32_t{FBVINS_SOCKET_WELCOME});
    for (std::int64_t i = 0; i < 50; ++i) {
      const FbvinsSocketReading reading{i, {0, 0, 0}, {0, 0, 9.8}};
      sender.send_readings({&reading, 1});
    }
    ASSERT_TRUE(status_->take(LiveStatus{}));  // which it will not read
  }
  EXPECT_EQ(inbox_.readings(1000).size(), 1000u);
}

TEST_F(SocketSourceTest, ASecondSenderIsToldWhoIsThere) {
  TestSender first(path());
  ASSERT_EQ(first.begin(), std::uint32_t{FBVINS_SOCKET_WELCOME});
  TestSender second(path());
  EXPECT_EQ(second.begin(), std::uint32_t{FBVINS_SOCKET_GOODBYE});
  EXPECT_EQ(second.last<FbvinsSocketGoodbye>().reason, std::uint32_t{FBVINS_SOCKET_BUSY});
  EXPECT_STREQ(second.last<FbvinsSocketGoodbye>().text, "another sender is connected: tester");
  first.send_frame(5, 0, 1);
  EXPECT_EQ(inbox_.frames(1).size(), 1u);
}

TEST_F(SocketSourceTest, WrongHellosAreRefusedWithTheReason) {
  const FileDescriptor memory = test::test_memory();
  FbvinsSocketHello hello = hello_message(nullptr);
  hello.major = 2;
  const std::string other_version =
      fmt::format("the sender speaks version {}.{} of the protocol, this program {}.{}", FBVINS_SOCKET_MAJOR + 1,
                  FBVINS_SOCKET_MINOR, FBVINS_SOCKET_MAJOR, FBVINS_SOCKET_MINOR);
  EXPECT_EQ(refusal(hello, memory), other_version);
  EXPECT_EQ(refusal(hello_message(nullptr), test::test_memory(test::kSlots * test::kSlotBytes, F_SEAL_GROW)),
            "the images' memory is not sealed with F_SEAL_SHRINK");
  EXPECT_EQ(refusal(hello_message(nullptr), FileDescriptor()), "hello: 0 file descriptors instead of one");
  EXPECT_EQ(refusal(hello_message(nullptr), memory, 3), "hello: 3 file descriptors instead of one");
  EXPECT_EQ(refusal(hello_message(nullptr), memory, 8), "hello: 4 file descriptors instead of one");
  hello = hello_message(nullptr);
  hello.width_px = 60;
  EXPECT_EQ(refusal(hello, memory), "images of 60 x 48 pixels, the calibration is for 64 x 48");
  EXPECT_TRUE(inbox_.hears("a sender: " + other_version));
  expect_service();
}

TEST_F(SocketSourceTest, ASenderWithoutAHelloIsLetGo) {
  end();
  open(test::socket_test_rig(), 0.2);
  TestSender silent(path());
  EXPECT_EQ(silent.answer(), std::uint32_t{FBVINS_SOCKET_GOODBYE});
  EXPECT_EQ(silent.last<FbvinsSocketGoodbye>().reason, std::uint32_t{FBVINS_SOCKET_TOO_SLOW});
  TestSender early(path());
  early.send_frame(1, 0, 1);
  EXPECT_EQ(early.answer(), std::uint32_t{FBVINS_SOCKET_GOODBYE});
  EXPECT_STREQ(early.last<FbvinsSocketGoodbye>().text, "the first message is not a hello");
  expect_service();
}

TEST_F(SocketSourceTest, WrongMessagesEndTheConnectionAndNothingElse) {
  const auto told = [&](const auto& misbehave) {
    TestSender sender(path());
    EXPECT_EQ(sender.begin(), std::uint32_t{FBVINS_SOCKET_WELCOME});
    misbehave(sender);
    std::uint32_t answer = 0;
    while ((answer = sender.answer()) == FBVINS_SOCKET_RELEASED) {
    }
    EXPECT_EQ(answer, std::uint32_t{FBVINS_SOCKET_GOODBYE});
    EXPECT_EQ(sender.last<FbvinsSocketGoodbye>().reason, std::uint32_t{FBVINS_SOCKET_MALFORMED});
    return std::string(sender.last<FbvinsSocketGoodbye>().text);
  };
  EXPECT_EQ(told([](TestSender& s) { s.send_frame(5, 0, 1), s.send_frame(6, 0, 2); }),
            "frame: slot 0 again, which is not released");
  EXPECT_EQ(told([](TestSender& s) { s.send_frame(5, test::kSlots, 1); }), "frame: no slot 4, there are 4");
  EXPECT_EQ(told([](TestSender& s) { s.send_frame(-5, 0, 1); }), "frame: stamp -5 ns");
  EXPECT_EQ(told([](TestSender& s) { s.send(bytes_of(hello_message(nullptr))); }), "a second hello");
  EXPECT_EQ(told([](TestSender& s) { s.send(std::vector<std::byte>(40'000)); }), "a message longer than any");
  EXPECT_EQ(told([](TestSender& s) { s.send(bytes_of(FbvinsSocketHeader{999, 8})); }), "no message has type 999");
  expect_service();
}

TEST_F(SocketSourceTest, GarbageNeverTakesItDown) {
  Rng rng(11);
  const StereoRig rig = test::socket_test_rig();
  for (int i = 0; i < 300; ++i) {
    TestSender sender(path());
    if (i % 3 != 0) sender.begin(&rig);
    for (int k = 0; k < 4; ++k) {
      std::vector<std::byte> noise(rng.below(600));
      for (auto& b : noise) b = static_cast<std::byte>(rng.below(256));
      const FbvinsSocketHeader header{rng.below(6), static_cast<std::uint32_t>(noise.size())};
      if (noise.size() >= sizeof(header) && rng.below(4) != 0) std::memcpy(noise.data(), &header, sizeof(header));
      sender.send(noise, rng.below(5) == 0 ? 0 : -1);
    }
  }
  expect_service();
}

TEST_F(SocketSourceTest, UnknownMessagesOfALaterMinorVersionAreIgnored) {
  TestSender sender(path());
  FbvinsSocketHello hello = hello_message(nullptr);
  hello.minor = FBVINS_SOCKET_MINOR + 3;
  const FileDescriptor memory = test::test_memory();
  sender.send(bytes_of(hello), memory.number());
  ASSERT_EQ(sender.answer(), std::uint32_t{FBVINS_SOCKET_WELCOME});
  sender.send(bytes_of(FbvinsSocketHeader{999, 8}));
  sender.send_frame(5, 0, 1);
  EXPECT_EQ(inbox_.frames(1).size(), 1u);
}

class SocketSourceWithoutRig : public SocketSourceTest {
 protected:
  void SetUp() override {}
};

TEST_F(SocketSourceWithoutRig, TakesTheFirstSendersCalibrationAndKeepsToIt) {
  const StereoRig rig = test::socket_test_rig();
  std::uint32_t welcome = 0;
  std::thread senders([&] {
    // The file is there a moment before anybody listens.
    while (!TestSender(path()).connected()) std::this_thread::sleep_for(1ms);
    EXPECT_EQ(TestSender(path()).begin(), std::uint32_t{FBVINS_SOCKET_GOODBYE});  // has none
    TestSender sender(path());
    welcome = sender.begin(&rig);
  });
  open(std::nullopt);
  senders.join();
  EXPECT_EQ(welcome, std::uint32_t{FBVINS_SOCKET_WELCOME});
  EXPECT_TRUE(inbox_.hears("no calibration: neither here nor in the hello"));
  EXPECT_EQ(source_->rig().T_BC1().p, rig.T_BC1().p);
  EXPECT_EQ(source_->rig().left().width(), test::kWidth);
  EXPECT_TRUE(inbox_.hears("tester: left"));

  StereoRig other = rig;
  other.cameras[1].T_BC.p.x() += 1e-6;
  {
    TestSender sender(path());
    EXPECT_EQ(sender.begin(&other), std::uint32_t{FBVINS_SOCKET_GOODBYE});
    EXPECT_EQ(sender.last<FbvinsSocketGoodbye>().reason, std::uint32_t{FBVINS_SOCKET_WRONG_RIG});
  }
  {
    TestSender sender(path());
    EXPECT_EQ(sender.begin(&rig), std::uint32_t{FBVINS_SOCKET_WELCOME});
  }
  expect_service();
}

TEST_F(SocketSourceWithoutRig, WaitingCanBeGivenUp) {
  const auto source = SocketSource::open(path(), {.give_up = [] { return true; }});
  ASSERT_FALSE(source);
  EXPECT_EQ(source.error().message, path() + ": no sender came");
  EXPECT_FALSE(std::filesystem::exists(path()));
}

}  // namespace socket_source_test
}  // namespace fbvins
