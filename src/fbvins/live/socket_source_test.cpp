// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/socket_source.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <limits>
#include <mutex>
#include <thread>

#include "fbvins/core/rng.hpp"
#include "fbvins/live/socket_test_sender.hpp"

namespace fbvins {
namespace socket_source_test {

using namespace std::chrono_literals;
using test::bytes_of;
using test::hello_message;
using test::TestSender;

/// Keeps what arrives, for a test to wait for.
class Inbox final : public SensorInput {
 public:
  void push(const ImuSample& sample) override {
    change([&] { readings_.push_back(sample); });
  }
  void push(StereoFrame frame) override {
    change([&] { frames_.push_back(std::move(frame)); });
  }
  void push_anchor(Anchor anchor) override {
    change([&] { anchors_.push_back(std::move(anchor)); });
  }
  void say(const std::string& what) {
    change([&] { said_.push_back(what); });
  }

  std::vector<ImuSample> readings(std::size_t count) { return wait_for(readings_, count); }
  std::vector<Anchor> anchors(std::size_t count) { return wait_for(anchors_, count); }
  std::vector<StereoFrame> frames(std::size_t count) { return wait_for(frames_, count); }
  void drop_frames() {
    change([&] { frames_.clear(); });
  }
  /// True if a message with these words comes within ten seconds.
  bool hears(const std::string& words) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, 10s, [&] {
      return std::any_of(said_.begin(), said_.end(), [&](const auto& s) { return s.find(words) != std::string::npos; });
    });
  }

 private:
  void change(const auto& what) {
    const std::lock_guard lock(mutex_);
    what();
    changed_.notify_all();
  }
  template <class T>
  std::vector<T> wait_for(const std::vector<T>& values, std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, 10s, [&] { return values.size() >= count; });
    return values;
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<ImuSample> readings_;
  std::vector<StereoFrame> frames_;
  std::vector<Anchor> anchors_;
  std::vector<std::string> said_;
};

class SocketSourceTest : public testing::Test {
 protected:
  /// A machine may be too busy to say hello at once, or for ten seconds; a sender that never comes must not hang the test.
  void open(std::optional<StereoRig> rig, double hello_s = 30) {
    const auto begin = std::chrono::steady_clock::now();
    auto source = SocketSource::open(path(), {.rig = std::move(rig),
                                              .say = [this](const auto& what) { inbox_.say(what); },
                                              .give_up = [=] { return std::chrono::steady_clock::now() - begin > 60s; },
                                              .hello_s = hello_s});
    ASSERT_TRUE(source) << source.error().message;
    source_ = *std::move(source);
    status_ = source_->status_sink();
    thread_ = std::thread([this] { EXPECT_TRUE(source_->run(inbox_)); });
  }
  void SetUp() override { open(test::socket_test_rig()); }
  void TearDown() override { end(); }
  void end() {
    if (!thread_.joinable()) return;
    source_->stop();
    thread_.join();
    source_.reset();
  }
  std::string path() const { return folder_.path(); }
  /// The source's answer to this first message.
  std::string refusal(const FbvinsSocketHello& hello, const FileDescriptor& memory, int copies = 1) {
    TestSender sender(path());
    sender.send(bytes_of(hello), memory.number(), copies);
    EXPECT_EQ(sender.answer(), std::uint32_t{FBVINS_SOCKET_GOODBYE});
    return sender.last<FbvinsSocketGoodbye>().text;
  }
  /// A good sender is still served.
  void expect_service(std::int64_t t_ns = 77) {
    TestSender sender(path());
    ASSERT_EQ(sender.begin(), std::uint32_t{FBVINS_SOCKET_WELCOME});
    inbox_.drop_frames();
    sender.send_frame(t_ns, 0, 1);
    const auto frames = inbox_.frames(1);
    ASSERT_EQ(frames.size(), 1u);
    EXPECT_EQ(frames[0].t, Time{t_ns});
  }

  test::SocketFolder folder_;
  Inbox inbox_;
  std::unique_ptr<SocketSource> source_;
  std::unique_ptr<Sink> status_;
  std::thread thread_;
};

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
  EXPECT_TRUE(frames[0].left->foreign());
  EXPECT_EQ(frames[0].left->at(7, 9), static_cast<std::uint8_t>(3 * (9 * test::kWidth + 7)));
  EXPECT_EQ(frames[0].right->at(7, 9), static_cast<std::uint8_t>(5 * (9 * test::kWidth + 7)));
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
  for (std::size_t round = 0; round < 10; ++round) EXPECT_EQ(frames[2 + round].left->at(0, 0), round);
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
  EXPECT_EQ(inbox_.frames(6)[5].right->at(3, 3), 0);  // its pixels are there
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

TEST_F(SocketSourceTest, TheSenderHearsOfTheEstimatorsHealthAndOfWhatArrived) {
  TestSender sender(path());
  ASSERT_EQ(sender.begin(), std::uint32_t{FBVINS_SOCKET_WELCOME});
  FbvinsSocketReading bad{9, {std::numeric_limits<double>::quiet_NaN(), 0, 0}, {0, 0, 0}};
  sender.send_readings({&bad, 1});
  sender.send_frame(5, 0, 1);
  sender.send_frame(6, 1, 4);
  ASSERT_EQ(inbox_.frames(2).size(), 2u);
  LiveStatus status;
  status.health = {HealthState::degraded, HealthReason::one_camera};
  status.reset_counter = 3;
  ASSERT_TRUE(status_->take(status));
  FbvinsSocketStatus heard{};
  do {
    const auto bytes = sender.receive();
    ASSERT_EQ(bytes.size(), sizeof(heard));
    std::memcpy(&heard, bytes.data(), sizeof(heard));
    ASSERT_EQ(heard.header.type, std::uint32_t{FBVINS_SOCKET_STATUS});
  } while (heard.health != FBVINS_SOCKET_DEGRADED);
  EXPECT_EQ(heard.reset_counter, 3u);
  EXPECT_EQ(heard.frames, 2u);
  EXPECT_EQ(heard.frames_missed, 2u);
  EXPECT_EQ(heard.readings_refused, 1u);
  EXPECT_EQ(heard.slots_held, 2u);
}

/// The next FbvinsSocketMap that a sender gets.
FbvinsSocketMap heard_map(TestSender& sender) {
  EXPECT_EQ(sender.answer(), std::uint32_t{FBVINS_SOCKET_MAP});
  return sender.last<FbvinsSocketMap>();
}

TEST_F(SocketSourceTest, TheSenderHearsWhereWLiesInTheMapAndHowMHasMoved) {
  MapUpdate update;
  update.t = Time{7};
  update.localised = true;
  update.reset_counter = 2;
  update.T_MW = {Quat::Identity(), Vec3(1, 2, 3)};
  update.T_MW_smooth = {Quat::Identity(), Vec3(1, 2, 2)};
  const Pose<M, M> turned(Quat(0, 0, 0, 1), Vec3(0, 0, 0)), moved(Quat::Identity(), Vec3(5, 0, 0));
  update.M_moved = turned;
  ASSERT_TRUE(status_->take(update));
  update.M_moved = moved;
  update.anchored = true;
  ASSERT_TRUE(status_->take(update));
  {
    TestSender sender(path());
    ASSERT_EQ(sender.begin(), std::uint32_t{FBVINS_SOCKET_WELCOME});
    const FbvinsSocketMap map = heard_map(sender);  // from before it came
    EXPECT_EQ(map.t_ns, 7);
    EXPECT_EQ(map.reset_counter, 2u);
    EXPECT_EQ(map.flags, std::uint32_t{FBVINS_SOCKET_LOCALISED | FBVINS_SOCKET_ANCHORED});
    EXPECT_EQ(map.p_MW[2], 3);
    EXPECT_EQ(map.p_smooth[2], 2);
    EXPECT_EQ(map.q_MW[0], 1);
    EXPECT_EQ(map.moves, 2u);
    EXPECT_EQ(map.p_MM0[0], 5) << "the moves one after the other";
    EXPECT_EQ(map.q_MM0[3], 1);
    update = {};
    ASSERT_TRUE(status_->take(update));
    const FbvinsSocketMap lost = heard_map(sender);
    EXPECT_EQ(lost.flags, 0u);
    EXPECT_EQ(lost.q_MW[0], 0);
    EXPECT_EQ(lost.moves, 2u);
  }
  TestSender earlier(path());
  FbvinsSocketHello hello = hello_message(nullptr);
  hello.minor = 6;
  const FileDescriptor memory = test::test_memory();
  earlier.send(bytes_of(hello), memory.number());
  ASSERT_EQ(earlier.answer(), std::uint32_t{FBVINS_SOCKET_WELCOME});
  ASSERT_TRUE(status_->take(update));
  LiveStatus status;
  status.reset_counter = 9;
  ASSERT_TRUE(status_->take(status));
  for (FbvinsSocketStatus heard{}; heard.reset_counter != 9;) {  // and no message that it does not know
    const auto bytes = earlier.receive();
    ASSERT_EQ(bytes.size(), sizeof(heard));
    std::memcpy(&heard, bytes.data(), sizeof(heard));
    ASSERT_EQ(heard.header.type, std::uint32_t{FBVINS_SOCKET_STATUS});
  }
}

TEST_F(SocketSourceTest, ASenderThatNeverReadsIsStillHeard) {
  TestSender sender(path());
  ASSERT_EQ(sender.begin(), std::uint32_t{FBVINS_SOCKET_WELCOME});
  for (std::uint32_t i = 0; i < 3000; ++i) {  // more than a socket takes
    LiveStatus status;
    status.reset_counter = i;
    ASSERT_TRUE(status_->take(status));
    if (i % 100 == 0) std::this_thread::sleep_for(1ms);
  }
  const FbvinsSocketReading reading{50, {0, 0, 0}, {0, 0, 9.8}};
  sender.send_readings({&reading, 1});
  EXPECT_EQ(inbox_.readings(1).size(), 1u);
}

TEST_F(SocketSourceTest, StopEndsItAtOnceAndTellsTheSender) {
  TestSender sender(path());
  ASSERT_EQ(sender.begin(), std::uint32_t{FBVINS_SOCKET_WELCOME});
  end();
  EXPECT_EQ(sender.answer(), std::uint32_t{FBVINS_SOCKET_GOODBYE});
  EXPECT_EQ(sender.last<FbvinsSocketGoodbye>().reason, std::uint32_t{FBVINS_SOCKET_DONE});
  EXPECT_FALSE(TestSender(path()).connected());
  EXPECT_TRUE(status_->take(LiveStatus{}));  // the sink outlives the source
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
  EXPECT_EQ(source_->rig().T_BC1.p, rig.T_BC1.p);
  EXPECT_EQ(source_->rig().left.width(), test::kWidth);
  EXPECT_TRUE(inbox_.hears("tester: left"));

  StereoRig other = rig;
  other.T_BC1.p.x() += 1e-6;
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
