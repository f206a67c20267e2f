// SPDX-License-Identifier: Apache-2.0
// Bytes to and from a UDP peer or a serial port that may come and go. No call blocks.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

struct UdpAddress {
  std::string host;
  std::uint16_t port = 0, own_port = 0;  ///< own_port 0: any
};
struct SerialAddress {
  std::string device;
  int baud = 0;
};
using LinkAddress = std::variant<UdpAddress, SerialAddress>;

/// `udp:HOST:PORT[:OWN_PORT]` or `serial:DEVICE:BAUD`.
Result<LinkAddress> parse_link_address(const std::string& text);

class ByteLink {
 public:
  explicit ByteLink(LinkAddress address) : address_(std::move(address)) {}

  /// Tries once; false: problem() says why.
  bool open();
  bool is_open() const { return static_cast<bool>(descriptor_); }
  int descriptor() const { return descriptor_.number(); }
  const std::string& problem() const { return problem_; }

  /// Takes the packet whole or not at all; false: it is dropped, as the port is closed or its queue full.
  bool send(std::span<const std::uint8_t> packet);
  /// The bytes that have arrived. A broken port is closed.
  std::vector<std::uint8_t> receive();
  /// Sends what a serial port did not accept before.
  void flush();
  bool has_unsent() const { return !unsent_.empty(); }

 private:
  void shut(const std::string& why);

  LinkAddress address_;
  FileDescriptor descriptor_;
  std::deque<std::uint8_t> unsent_;
  std::string problem_;
};

}  // namespace fbvins
