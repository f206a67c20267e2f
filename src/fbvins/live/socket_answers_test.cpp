// SPDX-License-Identifier: Apache-2.0
// What a sender hears from the socket's other side.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <thread>

#include "tests/support/socket_source_fixture.hpp"

namespace fbvins {
namespace socket_answers_test {

using namespace socket_source_fixture;

class SocketAnswers : public SocketSourceTest {};

TEST_F(SocketAnswers, TheSenderHearsOfTheEstimatorsHealthAndOfWhatArrived) {
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

TEST_F(SocketAnswers, TheSenderHearsWhereWLiesInTheMapAndHowMHasMoved) {
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

TEST_F(SocketAnswers, ASenderThatNeverReadsIsStillHeard) {
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

TEST_F(SocketAnswers, StopEndsItAtOnceAndTellsTheSender) {
  TestSender sender(path());
  ASSERT_EQ(sender.begin(), std::uint32_t{FBVINS_SOCKET_WELCOME});
  end();
  EXPECT_EQ(sender.answer(), std::uint32_t{FBVINS_SOCKET_GOODBYE});
  EXPECT_EQ(sender.last<FbvinsSocketGoodbye>().reason, std::uint32_t{FBVINS_SOCKET_DONE});
  EXPECT_FALSE(TestSender(path()).connected());
  EXPECT_TRUE(status_->take(LiveStatus{}));  // the sink outlives the source
}

}  // namespace socket_answers_test
}  // namespace fbvins
