// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/loopback_port.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>

namespace fbvins {

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

FileDescriptor bound_to_loopback(int type, int port) {
  FileDescriptor fd(socket(AF_INET, type | SOCK_CLOEXEC, 0));
  const int yes = 1;
  if (type == SOCK_STREAM) setsockopt(fd.number(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const sockaddr_in address = loopback(port);
  if (!fd || bind(fd.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return {};
  return fd;
}

std::uint16_t port_of(const FileDescriptor& socket) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  if (getsockname(socket.number(), reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
  return ntohs(address.sin_port);
}

bool readable(int descriptor, int timeout_ms) {
  pollfd state{descriptor, POLLIN, 0};
  return ::poll(&state, 1, timeout_ms) > 0;
}

}  // namespace fbvins
