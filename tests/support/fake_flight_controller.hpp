// SPDX-License-Identifier: Apache-2.0
// For tests: a flight controller that is simulated here, in wall time.
#pragma once

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>

#include <atomic>
#include <mutex>
#include <string>
#include <thread>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/live/host_clock.hpp"
#include "fbvins/mavlink/wire.hpp"

namespace fbvins {

/// A flight controller on a UDP port: heartbeats, answers to TIMESYNC, readings on request. Its clock is ahead.
class FakeFlightController {
 public:
  explicit FakeFlightController(Duration ahead) : ahead_(ahead), socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(socket_.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    socklen_t size = sizeof address;
    ::getsockname(socket_.number(), reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    listener_ = std::thread([this] { listen(); });
  }
  ~FakeFlightController() {
    ending_ = true;
    listener_.join();
  }
  std::string address() const { return fmt::format("udp:127.0.0.1:{}:0", port_); }
  bool was_synchronised() const { return answers_ > 10; }
  void read(Time t, const Vec3& gyro, const Vec3& accel) {
    HighresImuMessage m;
    m.time_usec = static_cast<std::uint64_t>((t + ahead_).ns / 1000);
    for (int i = 0; i < 3; ++i) {
      m.gyro[static_cast<std::size_t>(i)] = static_cast<float>(gyro[i]);
      m.acc[static_cast<std::size_t>(i)] = static_cast<float>(accel[i]);
    }
    m.fields_updated = 0xffff;
    say(m);
  }

 private:
  void say(const MavlinkMessage& message) {
    const std::lock_guard lock(mutex_);
    if (peer_.sin_port == 0) return;
    const auto frame = encode_mavlink(message, {1, 1}, sequence_++);
    ::sendto(socket_.number(), frame.data(), frame.size(), 0, reinterpret_cast<const sockaddr*>(&peer_), sizeof peer_);
  }
  void listen() {
    MavlinkDecoder decoder;
    Time next_beat = host_now();
    while (!ending_) {
      if (host_now() >= next_beat) {
        HeartbeatMessage beat;
        beat.autopilot = 12;
        say(beat);
        next_beat = next_beat + Duration{200'000'000};
      }
      pollfd waiting{socket_.number(), POLLIN, 0};
      if (::poll(&waiting, 1, 20) <= 0) continue;
      std::uint8_t bytes[2048];
      sockaddr_in from{};
      socklen_t size = sizeof from;
      const ssize_t got = ::recvfrom(socket_.number(), bytes, sizeof bytes, 0, reinterpret_cast<sockaddr*>(&from), &size);
      if (got <= 0) continue;
      {
        const std::lock_guard lock(mutex_);
        peer_ = from;
      }
      for (const MavlinkFrame& frame : decoder.push({bytes, static_cast<std::size_t>(got)}))
        if (const auto* question = std::get_if<TimesyncMessage>(&frame.message); question && question->tc1 == 0) {
          say(TimesyncMessage{(host_now() + ahead_).ns, question->ts1});
          ++answers_;
        }
    }
  }

  Duration ahead_;
  FileDescriptor socket_;
  int port_ = 0;
  std::mutex mutex_;
  sockaddr_in peer_{};
  std::uint8_t sequence_ = 0;
  std::atomic<bool> ending_ = false;
  std::atomic<int> answers_ = 0;
  std::thread listener_;
};

}  // namespace fbvins
