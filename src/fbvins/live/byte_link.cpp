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
#include <charconv>
#include <cstring>
#include <utility>

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

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == ':') parts.emplace_back();
    else parts.back() += c;
  }
  return parts;
}

/// -1 where the text is not a whole number.
long number(const std::string& text) {
  long value = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? value : -1;
}

Error bad_address(const std::string& text, const std::string& why) {
  return {ErrorCode::invalid_argument, fmt::format("'{}' is no MAVLink address: {}", text, why)};
}

Result<LinkAddress> parse_udp(const std::string& text, const std::vector<std::string>& parts) {
  if (parts.size() < 3 || parts.size() > 4) return bad_address(text, "it is udp:HOST:PORT or udp:HOST:PORT:OWN_PORT");
  const std::string host = parts[1] == "localhost" ? "127.0.0.1" : parts[1];
  in_addr address{};
  if (inet_pton(AF_INET, host.c_str(), &address) != 1)
    return bad_address(text, fmt::format("'{}' is neither an IPv4 address nor localhost", parts[1]));
  const long port = number(parts[2]), own = parts.size() == 4 ? number(parts[3]) : 0;
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

FileDescriptor open_port(const UdpAddress& address) {
  FileDescriptor fd(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const sockaddr_in own = socket_address("0.0.0.0", address.own_port);
  if (!fd || bind(fd.number(), reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0) return {};
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

}  // namespace

Result<LinkAddress> parse_link_address(const std::string& text) {
  const std::vector<std::string> parts = split(text);
  if (parts[0] == "udp") return parse_udp(text, parts);
  if (parts[0] == "serial") return parse_serial(text, parts);
  return bad_address(text, "it begins with udp: or serial:");
}

bool ByteLink::open() {
  shut("");
  errno = 0;
  descriptor_ = std::visit([](const auto& address) { return open_port(address); }, address_);
  if (is_open()) return true;
  const int error = errno;
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

bool ByteLink::send(std::span<const std::uint8_t> packet) {
  if (!is_open()) return false;
  if (const auto* udp = std::get_if<UdpAddress>(&address_)) {
    const sockaddr_in to = socket_address(udp->host, udp->port);
    return sendto(descriptor(), packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to) ==
           static_cast<ssize_t>(packet.size());
  }
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

std::vector<std::uint8_t> ByteLink::receive() {
  std::vector<std::uint8_t> bytes;
  if (!is_open()) return bytes;
  // read() returns 0 only after a hang-up; a port without data is not readable.
  pollfd state{descriptor(), POLLIN, 0};
  for (int rounds = 0; rounds < 16 && ::poll(&state, 1, 0) > 0; ++rounds) {
    std::array<std::uint8_t, 2048> piece{};
    const ssize_t got = ::read(descriptor(), piece.data(), piece.size());
    if (got > 0) {
      bytes.insert(bytes.end(), piece.begin(), piece.begin() + got);
    } else if (got < 0 && later(errno)) {
      break;
    } else if (std::holds_alternative<SerialAddress>(address_)) {
      shut(fmt::format("{} is gone: {}", words(std::get<SerialAddress>(address_)), got < 0 ? std::strerror(errno) : "hung up"));
      break;
    }
  }
  return bytes;
}

}  // namespace fbvins
