// SPDX-License-Identifier: Apache-2.0
// Sockets towards a flight controller's program on this machine.
#pragma once

#include <netinet/in.h>

#include <cstdint>

#include "fbvins/core/file_descriptor.hpp"

namespace fbvins {

sockaddr_in loopback(int port);
/// A socket of `type` at 127.0.0.1; `port` 0: any. Empty where the port is taken.
FileDescriptor bound_to_loopback(int type, int port);
/// The number of the port to which a socket is bound.
std::uint16_t port_of(const FileDescriptor& socket);
/// Waits until something can be read, at most `timeout_ms`.
bool readable(int descriptor, int timeout_ms);

}  // namespace fbvins
