// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/byte_link.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "fbvins/core/text.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kLongestUnsent = 2048;  // a few poses: more would arrive too late to be of use

struct Baud {
  int rate;
  speed_t code;
};
constexpr std::array<Baud, 12> kBauds = {{{9600, B9600},
                                          {57600, B57600},
                                          {115200, B115200},
                                          {230400, B230400},
                                          {460800, B460800},
                                          {500000, B500000},
                                          {921600, B921600},
                                          {1000000, B1000000},
                                          {1500000, B1500000},
                                          {2000000, B2000000},
                                          {3000000, B3000000},
                                          {4000000, B4000000}}};

/// -1 where the text is not a whole number.
long number(const std::string& text) { return number_in<long>(text).value_or(-1); }

Error bad_address(const std::string& text, const std::string& why) {
  return {ErrorCode::invalid_argument, fmt::format("'{}' is no MAVLink address: {}", text, why)};
}

Result<LinkAddress> parse_udp(const std::string& text, const std::vector<std::string>& parts, std::uint16_t default_own_port) {
  if (parts.size() < 3 || parts.size() > 4) return bad_address(text, "it is udp:HOST:PORT or udp:HOST:PORT:OWN_PORT");
  const std::string host = parts[1] == "localhost" ? "127.0.0.1" : parts[1];
  in_addr address{};
  if (inet_pton(AF_INET, host.c_str(), &address) != 1)
    return bad_address(text, fmt::format("'{}' is neither an IPv4 address nor localhost", parts[1]));
  const long port = number(parts[2]), own = parts.size() == 4 ? number(parts[3]) : default_own_port;
  if (port < 1 || port > 65535 || own < 0 || own > 65535) return bad_address(text, "a port is a number from 1 to 65535");
  return LinkAddress{UdpAddress{host, static_cast<std::uint16_t>(port), static_cast<std::uint16_t>(own)}};
}

Result<LinkAddress> parse_serial(const std::string& text, const std::vector<std::string>& parts) {
  if (parts.size() != 3 || parts[1].empty()) return bad_address(text, "it is serial:DEVICE:BAUD");
  const long rate = number(parts[2]);
  if (std::none_of(kBauds.begin(), kBauds.end(), [&](const Baud& baud) { return baud.rate == rate; }))
    return bad_address(text, fmt::format("'{}' is no rate of a serial port; usual are 57600, 115200 and 921600", parts[2]));
  return LinkAddress{SerialAddress{parts[1], static_cast<int>(rate)}};
}

sockaddr_in socket_address(const std::string& host, std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  inet_pton(AF_INET, host.c_str(), &address.sin_addr);
  return address;
}

/// The address of this machine from which packets to another leave.
bool local_address_towards(const sockaddr_in& to, sockaddr_in& own) {
  const FileDescriptor probe(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  socklen_t size = sizeof own;
  return probe && connect(probe.number(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0 &&
         getsockname(probe.number(), reinterpret_cast<sockaddr*>(&own), &size) == 0;
}

FileDescriptor open_port(const UdpAddress& address) {
  FileDescriptor fd(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  sockaddr_in own{};
  if (!fd || !local_address_towards(socket_address(address.host, address.port), own)) return {};
  own.sin_port = htons(address.own_port);
  if (bind(fd.number(), reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0) return {};
  return fd;
}

FileDescriptor open_port(const SerialAddress& address) {
  FileDescriptor fd(::open(address.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  termios settings{};
  if (!fd || tcgetattr(fd.number(), &settings) != 0) return {};
  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  const auto baud = std::find_if(kBauds.begin(), kBauds.end(), [&](const Baud& b) { return b.rate == address.baud; });
  if (cfsetspeed(&settings, baud->code) != 0 || tcsetattr(fd.number(), TCSANOW, &settings) != 0) return {};
  return fd;
}

std::string words(const UdpAddress& address) {
  return address.own_port != 0 ? fmt::format("UDP port {}", address.own_port) : std::string("a UDP port");
}
std::string words(const SerialAddress& address) { return address.device; }

bool later(int error) { return error == EAGAIN || error == EWOULDBLOCK || error == EINTR; }

/// Errors of a port whose local address is gone, as when a network is set up anew.
bool address_is_gone(int error) { return error == EINVAL || error == EADDRNOTAVAIL || error == ENETDOWN || error == ENETUNREACH; }

/// A packet costs a few microseconds; who floods the port must not hold up the thread.
constexpr int kMostPackets = 64;

}  // namespace

Result<LinkAddress> parse_link_address(const std::string& text, std::uint16_t default_own_port) {
  const std::vector<std::string> parts = split(text, ':');
  if (parts[0] == "udp") return parse_udp(text, parts, default_own_port);
  if (parts[0] == "serial") return parse_serial(text, parts);
  return bad_address(text, "it begins with udp: or serial:");
}

bool ByteLink::open() {
  shut("");
  errno = 0;
  descriptor_ = std::visit([](const auto& address) { return open_port(address); }, address_);
  const int error = errno;
  if (is_open()) {
    forget_peer();
    return true;
  }
  problem_ = std::visit(
      [&](const auto& address) { return fmt::format("{} cannot be opened: {}", words(address), std::strerror(error)); },
      address_);
  return false;
}

void ByteLink::shut(const std::string& why) {
  descriptor_ = FileDescriptor();
  unsent_.clear();
  problem_ = why;
}

void ByteLink::forget_peer() {
  peer_ = Endpoint{};
  const auto* udp = std::get_if<UdpAddress>(&address_);
  if (udp == nullptr) return;
  const sockaddr_in to = socket_address(udp->host, udp->port);
  if (udp->peer_is_learnt) peer_.reset();
  else peer_ = Endpoint{to.sin_addr.s_addr, to.sin_port};
}

void ByteLink::pin_to_sender() { peer_ = sender_; }

bool ByteLink::send_packet(std::span<const std::uint8_t> packet) {
  const auto& udp = std::get<UdpAddress>(address_);
  sockaddr_in to = socket_address(udp.host, udp.port);
  if (peer_) to.sin_addr.s_addr = peer_->address, to.sin_port = peer_->port;
  const ssize_t sent = sendto(descriptor(), packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  if (sent < 0 && address_is_gone(errno)) shut(fmt::format("{} is gone: {}", words(udp), std::strerror(errno)));
  return sent == static_cast<ssize_t>(packet.size());
}

bool ByteLink::send(std::span<const std::uint8_t> packet) {
  if (!is_open()) return false;
  if (std::holds_alternative<UdpAddress>(address_)) return send_packet(packet);
  if (unsent_.size() + packet.size() > kLongestUnsent) return false;
  unsent_.insert(unsent_.end(), packet.begin(), packet.end());
  flush();
  return is_open();
}

void ByteLink::flush() {
  while (is_open() && !unsent_.empty()) {
    std::array<std::uint8_t, 512> piece{};
    const std::size_t size = std::min(piece.size(), unsent_.size());
    std::copy_n(unsent_.begin(), size, piece.begin());
    const ssize_t sent = ::write(descriptor(), piece.data(), size);
    if (sent < 0 && later(errno)) return;
    if (sent <= 0)
      return shut(
          std::visit([](const auto& a) { return fmt::format("{} is gone: {}", words(a), std::strerror(errno)); }, address_));
    unsent_.erase(unsent_.begin(), unsent_.begin() + sent);
  }
}

/// One packet, of the peer; false: none has come.
bool ByteLink::receive_packet(std::vector<std::uint8_t>& bytes) {
  std::array<std::uint8_t, 2048> packet{};
  sockaddr_in from{};
  socklen_t size = sizeof from;
  const ssize_t got = recvfrom(descriptor(), packet.data(), packet.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
  if (got < 0) return !later(errno);  // else a refusal of an earlier packet of ours
  sender_ = {from.sin_addr.s_addr, from.sin_port};
  if (peer_ && sender_ != *peer_) {
    std::array<char, INET_ADDRSTRLEN> text{};
    inet_ntop(AF_INET, &from.sin_addr, text.data(), text.size());
    newest_stranger_ = fmt::format("{}:{}", text.data(), ntohs(from.sin_port));
    ++strangers_;
    return true;
  }
  bytes.insert(bytes.end(), packet.begin(), packet.begin() + got);
  return true;
}

/// What a serial port has; false: nothing, or it is closed.
bool ByteLink::receive_piece(std::vector<std::uint8_t>& bytes) {
  // read() returns 0 only after a hang-up; a port without data is not readable.
  pollfd state{descriptor(), POLLIN, 0};
  if (::poll(&state, 1, 0) <= 0) return false;
  std::array<std::uint8_t, 2048> piece{};
  const ssize_t got = ::read(descriptor(), piece.data(), piece.size());
  if (got > 0) bytes.insert(bytes.end(), piece.begin(), piece.begin() + got);
  else if (got == 0 || !later(errno))
    shut(fmt::format("{} is gone: {}", words(std::get<SerialAddress>(address_)), got < 0 ? std::strerror(errno) : "hung up"));
  return got > 0;
}

std::vector<std::uint8_t> ByteLink::receive() {
  std::vector<std::uint8_t> bytes;
  if (!is_open()) return bytes;
  const bool udp = std::holds_alternative<UdpAddress>(address_);
  for (int rounds = 0; rounds < kMostPackets; ++rounds) {
    if (!(udp ? receive_packet(bytes) : receive_piece(bytes))) break;
    if (!peer_ && !bytes.empty()) break;
  }
  return bytes;
}

}  // namespace fbvins
