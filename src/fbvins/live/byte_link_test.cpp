// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/byte_link.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

namespace fbvins {
namespace byte_link_test {

using Bytes = std::vector<std::uint8_t>;

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET, address.sin_port = htons(port), address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

sockaddr_in bound_to(int descriptor) {
  sockaddr_in own{};
  socklen_t size = sizeof own;
  EXPECT_EQ(getsockname(descriptor, reinterpret_cast<sockaddr*>(&own), &size), 0);
  return own;
}

/// A port of this machine.
struct Host {
  FileDescriptor fd{socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0)};
  std::uint16_t port = 0;

  Host() {
    const sockaddr_in any = loopback(0);
    EXPECT_EQ(bind(fd.number(), reinterpret_cast<const sockaddr*>(&any), sizeof any), 0);
    port = ntohs(bound_to(fd.number()).sin_port);
  }
  void send(const ByteLink& to, const Bytes& bytes) const {
    const sockaddr_in there = bound_to(to.descriptor());
    EXPECT_EQ(sendto(fd.number(), bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&there), sizeof there),
              static_cast<ssize_t>(bytes.size()));
  }
  Bytes receive() const {
    pollfd state{fd.number(), POLLIN, 0};
    ::poll(&state, 1, 1000);
    Bytes bytes(100);
    const ssize_t got = recv(fd.number(), bytes.data(), bytes.size(), 0);
    bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    return bytes;
  }
};

ByteLink link_to(const Host& host, bool learnt = false) { return ByteLink(UdpAddress{"127.0.0.1", host.port, 0, learnt}); }

TEST(ByteLink, OnThisMachineItIsNotReachedFromOthers) {
  const Host host;
  ByteLink link = link_to(host);
  ASSERT_TRUE(link.open());
  EXPECT_EQ(ntohl(bound_to(link.descriptor()).sin_addr.s_addr), INADDR_LOOPBACK);
}

TEST(ByteLink, TakesThePacketsOfItsPeerAlone) {
  const Host host, stranger;
  ByteLink link = link_to(host);
  ASSERT_TRUE(link.open());
  for (std::uint8_t i = 0; i < 3; ++i) {
    stranger.send(link, {9, 9});
    host.send(link, {i, i});
  }
  EXPECT_EQ(link.receive(), (Bytes{0, 0, 1, 1, 2, 2}));
  EXPECT_EQ(link.strangers(), 3);
  EXPECT_EQ(link.newest_stranger(), "127.0.0.1:" + std::to_string(stranger.port));
}

TEST(ByteLink, AFloodDoesNotHoldUpTheThread) {
  const Host host, stranger;
  ByteLink link = link_to(host);
  ASSERT_TRUE(link.open());
  for (int i = 0; i < 100; ++i) stranger.send(link, {9});
  link.receive();
  EXPECT_LT(link.strangers(), 100);
}

TEST(ByteLink, APeerThatIsLearntGetsAndSendsEverythingFromThenOn) {
  const Host host, behind_nat, stranger;
  ByteLink link = link_to(host, true);
  ASSERT_TRUE(link.open());
  EXPECT_FALSE(link.has_peer());
  EXPECT_TRUE(link.send(Bytes{1}));
  EXPECT_EQ(host.receive(), Bytes{1});
  stranger.send(link, {9});
  behind_nat.send(link, {7});
  behind_nat.send(link, {8});
  EXPECT_EQ(link.receive(), Bytes{9});  // one at a time, for its owner to judge
  EXPECT_EQ(link.receive(), Bytes{7});
  link.pin_to_sender();
  stranger.send(link, {9});
  EXPECT_EQ(link.receive(), Bytes{8});
  EXPECT_EQ(link.strangers(), 1);
  EXPECT_TRUE(link.send(Bytes{2}));
  EXPECT_EQ(behind_nat.receive(), Bytes{2});
  link.forget_peer();
  EXPECT_FALSE(link.has_peer());
}

TEST(ByteLink, TheOwnPortIsTheSameAtEveryStart) {
  const auto link = [](const std::string& text) { return std::get<UdpAddress>(*parse_link_address(text)); };
  EXPECT_EQ(link("udp:127.0.0.1:14580").own_port, 14540);
  EXPECT_EQ(link("udp:127.0.0.1:14580:5000").own_port, 5000);
  EXPECT_EQ(link("udp:127.0.0.1:14580:0").own_port, 0);
  EXPECT_EQ(std::get<UdpAddress>(*parse_link_address("udp:127.0.0.1:14580", kOwnUdpPortForImu)).own_port, 14541);
}

TEST(ByteLink, APortInUseIsNamed) {
  const Host host, other;
  ByteLink link(UdpAddress{"127.0.0.1", host.port, other.port});
  EXPECT_FALSE(link.open());
  EXPECT_NE(link.problem().find("UDP port " + std::to_string(other.port)), std::string::npos) << link.problem();
}

}  // namespace byte_link_test
}  // namespace fbvins
