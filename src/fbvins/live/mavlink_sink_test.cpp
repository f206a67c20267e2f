// SPDX-License-Identifier: Apache-2.0
// The sink on a loopback socket and on a pseudo-terminal that is unplugged. Waits are bounded, but no timing is asserted.
#include "fbvins/live/mavlink_sink.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/mavlink/wire.hpp"

namespace fbvins {
namespace mavlink_sink_test {

bool comes_true(const std::function<bool()>& fact) {
  for (int i = 0; i < 2000; ++i) {
    if (fact()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

/// A flight controller at the other end of a descriptor, whose clock is 1000 s ahead.
struct FarEnd {
  MavlinkDecoder decoder;
  MavlinkSigner* signer = nullptr;
  int odometries = 0, heartbeats = 0, texts = 0, answers = 0;
  std::uint8_t newest_reset = 0;
  std::uint64_t newest_usec = 0;

  using Send = std::function<void(const std::vector<std::uint8_t>&)>;
  void hear(std::span<const std::uint8_t> bytes, const Send& send) {
    for (const MavlinkFrame& frame : decoder.push(bytes)) {
      if (const auto* odometry = std::get_if<OdometryMessage>(&frame.message)) {
        ++odometries;
        newest_reset = odometry->reset_counter, newest_usec = odometry->time_usec;
      } else if (std::holds_alternative<StatusTextMessage>(frame.message)) {
        ++texts;
      } else if (std::holds_alternative<HeartbeatMessage>(frame.message)) {
        ++heartbeats;
      } else if (const auto* sync = std::get_if<TimesyncMessage>(&frame.message)) {
        if (sync->tc1 == 0) send(encode_mavlink(TimesyncMessage{sync->ts1 + 1'000'000'000'000, sync->ts1}, {1, 1}, 0, signer));
        else ++answers;
      }
    }
  }
  void greet(const Send& send) {
    HeartbeatMessage beat;
    beat.autopilot = 12;
    send(encode_mavlink(beat, {1, 1}, 0, signer));
    send(encode_mavlink(TimesyncMessage{0, 5}, {1, 1}, 0, signer));
  }
};

LivePose pose(std::int64_t i, std::uint32_t resets = 0) {
  LivePose p;
  p.t = p.host_t = Time{i * 20'000'000};
  p.health = {HealthState::good, HealthReason::none};
  p.reset_counter = resets;
  return p;
}

/// Poses go out without a flight controller that answers.
MavlinkOptions own_clock() {
  MavlinkOptions options;
  options.clock = MavlinkClock::own;
  return options;
}

struct UdpEnd {
  FileDescriptor fd{socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0)};
  sockaddr_in peer{};
  FarEnd end;

  std::uint16_t bind_any() {
    sockaddr_in own{};
    own.sin_family = AF_INET, own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof own;
    EXPECT_EQ(bind(fd.number(), reinterpret_cast<sockaddr*>(&own), size), 0);
    EXPECT_EQ(getsockname(fd.number(), reinterpret_cast<sockaddr*>(&own), &size), 0);
    return ntohs(own.sin_port);
  }
  /// Learns where the sink's packets come from.
  bool hear_one() {
    std::array<std::uint8_t, 2048> bytes{};
    socklen_t size = sizeof peer;
    return recvfrom(fd.number(), bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&peer), &size) > 0;
  }
  void greet() {
    end.greet([this](const std::vector<std::uint8_t>& frame) {
      sendto(fd.number(), frame.data(), frame.size(), 0, reinterpret_cast<sockaddr*>(&peer), sizeof peer);
    });
  }
  void serve() {
    std::array<std::uint8_t, 2048> bytes{};
    socklen_t size = sizeof peer;
    const FarEnd::Send send = [this](const std::vector<std::uint8_t>& frame) {
      sendto(fd.number(), frame.data(), frame.size(), 0, reinterpret_cast<sockaddr*>(&peer), sizeof peer);
    };
    for (ssize_t got = 0;
         (got = recvfrom(fd.number(), bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&peer), &size)) > 0;) {
      const int beats = end.heartbeats;
      end.hear(std::span(bytes).first(static_cast<std::size_t>(got)), send);
      if (end.heartbeats > beats || end.odometries % 10 == 1) end.greet(send);
    }
  }
};

TEST(MavlinkSink, OverUdpPosesComeAndTheClockIsFound) {
  UdpEnd px4;
  const auto sink = MavlinkSink::create(fmt::format("udp:127.0.0.1:{}:0", px4.bind_any()), {});
  ASSERT_TRUE(sink);
  std::int64_t i = 0;
  EXPECT_TRUE((*sink)->take(LiveEvent(LiveStatus{})));
  EXPECT_TRUE(comes_true([&] {
    EXPECT_TRUE((*sink)->take(LiveEvent(pose(i++))));
    px4.serve();
    const bool on_its_clock = (*sink)->state().clock_known && px4.end.newest_usec > 999'000'000u;
    return px4.end.odometries > 20 && px4.end.answers > 0 && px4.end.texts > 0 && on_its_clock;
  }));
  EXPECT_NEAR((*sink)->state().clock_offset_s, 1000, 1);
  EXPECT_TRUE((*sink)->state().flight_controller);
  EXPECT_GE((*sink)->state().round_trip_ms, 0);
  EXPECT_LT((*sink)->state().round_trip_ms, 200);
  EXPECT_EQ((*sink)->figures()[2].name, "clock_known");
  EXPECT_TRUE(std::get<bool>((*sink)->figures()[2].value));
  EXPECT_TRUE((*sink)->finish());
}

/// A host that sends a flight controller's heartbeats, as anyone on the network may.
struct Stranger {
  FileDescriptor fd{socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0)};
  void beat(const sockaddr_in& to) const {
    HeartbeatMessage message;
    message.autopilot = 12;
    const auto frame = encode_mavlink(message, {1, 1}, 0);
    sendto(fd.number(), frame.data(), frame.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
};

TEST(MavlinkSink, OverUdpStrangersAreIgnoredAndCounted) {
  UdpEnd px4;
  const Stranger stranger;
  const auto sink = MavlinkSink::create(fmt::format("udp:127.0.0.1:{}:0", px4.bind_any()), {});
  ASSERT_TRUE(sink);
  EXPECT_TRUE(comes_true([&] { return px4.hear_one(); }));
  EXPECT_TRUE(comes_true([&] { return stranger.beat(px4.peer), (*sink)->state().packets_refused > 10; }));
  EXPECT_FALSE((*sink)->state().flight_controller);
  std::int64_t i = 0;
  EXPECT_TRUE(comes_true([&] {
    EXPECT_TRUE((*sink)->take(LiveEvent(pose(i++))));
    stranger.beat(px4.peer);
    px4.serve();
    return px4.end.odometries > 20;
  }));
  EXPECT_NE((*sink)->problem().find("packets of 127.0.0.1:"), std::string::npos) << (*sink)->problem();
}

TEST(MavlinkSink, OverUdpThePeerMayBeTheFirstFlightController) {
  UdpEnd configured, px4;
  MavlinkOptions options;
  options.udp_peer = MavlinkUdpPeer::first;
  const auto sink = MavlinkSink::create(fmt::format("udp:127.0.0.1:{}:0", configured.bind_any()), options);
  ASSERT_TRUE(sink);
  px4.bind_any();
  EXPECT_TRUE(comes_true([&] { return configured.hear_one(); }));
  px4.peer = configured.peer;  // behind an address translation its packets come from another port
  px4.greet();
  std::int64_t i = 0;
  EXPECT_TRUE(comes_true([&] {
    EXPECT_TRUE((*sink)->take(LiveEvent(pose(i++))));
    px4.serve();
    return px4.end.odometries > 20;
  }));
  configured.serve();
  EXPECT_EQ(configured.end.odometries, 0);
}

TEST(MavlinkSink, SignedFramesAloneAreTaken) {
  UdpEnd px4;
  const std::string folder = testing::TempDir(), key_file = folder + "fbvins_sink_key", time_file = folder + "fbvins_sink_time";
  std::ofstream(key_file) << std::string(64, 'a') << "\n";
  std::filesystem::remove(time_file);
  MavlinkOptions options;
  options.key_file = key_file, options.key_time_file = time_file;
  const auto sink = MavlinkSink::create(fmt::format("udp:127.0.0.1:{}:0", px4.bind_any()), options);
  if (!sink && sink.error().code == ErrorCode::unsupported) GTEST_SKIP() << sink.error().message;
  ASSERT_TRUE(sink) << sink.error().message;
  MavlinkKey key;
  key.fill(0xaa);
  MavlinkSigner signer(key, 0);
  px4.end.decoder = MavlinkDecoder(&signer);
  EXPECT_TRUE(comes_true([&] { return px4.serve(), (*sink)->state().frames_refused > 3; }));
  EXPECT_FALSE((*sink)->state().flight_controller);
  px4.end.signer = &signer;
  std::int64_t i = 0;
  EXPECT_TRUE(comes_true([&] {
    EXPECT_TRUE((*sink)->take(LiveEvent(pose(i++))));
    px4.serve();
    return px4.end.odometries > 20;
  }));
  EXPECT_EQ(px4.end.decoder.counts().unsigned_frames, 0);
  EXPECT_TRUE(std::filesystem::exists(time_file));
  options.key_file = "/no/such/key";
  EXPECT_FALSE(MavlinkSink::create("udp:127.0.0.1:9:0", options));
}

TEST(MavlinkSink, WhatWasTakenBeforeTheEndIsSent) {
  UdpEnd px4;
  const auto sink = MavlinkSink::create(fmt::format("udp:127.0.0.1:{}:0", px4.bind_any()), own_clock());
  for (int i = 0; i < 5; ++i) EXPECT_TRUE((*sink)->take(LiveEvent(pose(i, 4))));
  EXPECT_TRUE((*sink)->finish());
  px4.serve();
  EXPECT_EQ(px4.end.odometries, 5);
  EXPECT_EQ(px4.end.newest_reset, 4);
}

TEST(MavlinkSink, PosesInMHaveTheJumpsOfTheMap) {
  UdpEnd px4;
  MavlinkOptions options = own_clock();
  options.mounting.local_frame = LocalOrigin::map;
  const auto sink = MavlinkSink::create(fmt::format("udp:127.0.0.1:{}:0", px4.bind_any()), options);
  MapUpdate found;
  found.localised = found.found = true;
  found.reset_counter = 4;
  EXPECT_TRUE((*sink)->take(LiveEvent(pose(0, 4))));
  EXPECT_TRUE((*sink)->take(LiveEvent(found)));
  EXPECT_TRUE((*sink)->take(LiveEvent(pose(1, 4))));
  EXPECT_TRUE((*sink)->finish());
  px4.serve();
  EXPECT_EQ(px4.end.odometries, 2);
  EXPECT_EQ(px4.end.newest_reset, 5);
}

/// A serial cable: a pseudo-terminal under a name that stays.
struct Cable {
  std::filesystem::path folder;
  FileDescriptor master;
  FarEnd end;

  Cable() {
    std::string pattern = testing::TempDir() + "fbvins_cable_XXXXXX";
    folder = mkdtemp(pattern.data());
  }
  ~Cable() { std::filesystem::remove_all(folder); }
  std::string device() const { return folder / "tty"; }
  void plug() {
    master = FileDescriptor(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK));
    ASSERT_EQ(grantpt(master.number()) | unlockpt(master.number()), 0);
    std::filesystem::remove(device());
    std::filesystem::create_symlink(ptsname(master.number()), device());
    end = FarEnd();
  }
  void unplug() {
    std::filesystem::remove(device());
    master = FileDescriptor();
  }
  void serve() {
    const FarEnd::Send send = [this](const std::vector<std::uint8_t>& frame) {
      EXPECT_EQ(::write(master.number(), frame.data(), frame.size()), static_cast<ssize_t>(frame.size()));
    };
    std::array<std::uint8_t, 2048> bytes{};
    for (ssize_t got = 0; (got = ::read(master.number(), bytes.data(), bytes.size())) > 0;) {
      end.hear(std::span(bytes).first(static_cast<std::size_t>(got)), send);
      if (end.heartbeats > 0 && (end.answers == 0 || end.odometries % 10 == 1)) end.greet(send);
    }
  }
};

TEST(MavlinkSink, ASerialCableMayComeLateGoAndComeAgain) {
  Cable cable;
  const auto sink = MavlinkSink::create("serial:" + cable.device() + ":921600", {});
  ASSERT_TRUE(sink);
  std::int64_t i = 0;
  const auto step = [&] { EXPECT_TRUE((*sink)->take(LiveEvent(pose(i++)))); };
  EXPECT_TRUE(comes_true([&] { return step(), (*sink)->problem().find(cable.device()) != std::string::npos; }));

  cable.plug();
  EXPECT_TRUE(comes_true([&] { return step(), cable.serve(), cable.end.odometries > 20 && cable.end.answers > 0; }));
  EXPECT_EQ((*sink)->state().times_opened, 1);
  EXPECT_EQ((*sink)->problem(), "");

  cable.unplug();
  EXPECT_TRUE(comes_true([&] { return step(), !(*sink)->state().connected; }));
  EXPECT_NE((*sink)->problem(), "");

  cable.plug();
  EXPECT_TRUE(comes_true([&] { return step(), cable.serve(), cable.end.odometries > 20; }));
  EXPECT_EQ(cable.end.decoder.counts().noise_bytes, 0);  // begins with a whole frame
  EXPECT_EQ((*sink)->state().times_opened, 2);
}

TEST(MavlinkSink, ACableThatTakesNothingLosesWholeFrames) {
  Cable cable;
  cable.plug();
  const auto sink = MavlinkSink::create("serial:" + cable.device() + ":57600", own_clock());
  std::int64_t i = 0;
  EXPECT_TRUE(comes_true([&] { return (void)(*sink)->take(LiveEvent(pose(i++))).ok(), (*sink)->state().frames_dropped > 10; }));
  EXPECT_TRUE(
      comes_true([&] { return (void)(*sink)->take(LiveEvent(pose(i++))).ok(), cable.serve(), cable.end.odometries > 40; }));
  EXPECT_EQ(cable.end.decoder.counts().noise_bytes, 0);
}

TEST(MavlinkSink, AnAddressThatIsNoneIsSaidInASentence) {
  for (const char* address :
       {"", "udp", "udp:127.0.0.1", "udp:127.0.0.1:0", "udp:127.0.0.1:70000", "udp:drone.local:14540", "udp:127.0.0.1:1:2:3",
        "udp:1.2.3.4:12x", "serial:/dev/ttyS0", "serial:/dev/ttyS0:12345", "serial::57600", "tcp:127.0.0.1:5760"}) {
    const auto sink = MavlinkSink::create(address, {});
    ASSERT_FALSE(sink) << address;
    EXPECT_NE(sink.error().message.find(fmt::format("'{}'", address)), std::string::npos);
  }
  MavlinkOptions options;
  options.rate_hz = 0;
  const auto sink = MavlinkSink::create("udp:localhost:14580:14540", options);
  ASSERT_FALSE(sink);
  EXPECT_EQ(sink.error().message, "rate_hz = 0 is outside [1, 1000]");
}

}  // namespace mavlink_sink_test
}  // namespace fbvins
