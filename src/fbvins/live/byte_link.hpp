// SPDX-License-Identifier: Apache-2.0
// Bytes to and from a UDP peer or a serial port that may come and go. No call blocks.
//
// A UDP port is bound to the local address from which the peer is reached, 127.0.0.1 for a peer on this machine, and takes
// packets of its peer alone.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
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
  /// The peer is the sender of packets for which the owner calls pin_to_sender(); until then packets go to host and port.
  bool peer_is_learnt = false;
};
struct SerialAddress {
  std::string device;
  int baud = 0;
};
using LinkAddress = std::variant<UdpAddress, SerialAddress>;

/// A flight controller remembers the port of the companion that it first heard: a companion that starts again must have the same.
/// 14540 is the port to which PX4's simulator sends. A second connection of the program needs another one.
inline constexpr std::uint16_t kOwnUdpPort = 14540, kOwnUdpPortForImu = 14541;

/// `udp:HOST:PORT[:OWN_PORT]` or `serial:DEVICE:BAUD`. OWN_PORT 0: any.
Result<LinkAddress> parse_link_address(const std::string& text, std::uint16_t default_own_port = kOwnUdpPort);

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
  /// The bytes that have arrived; one packet of anyone's while the peer has to be learnt. A broken port is closed.
  std::vector<std::uint8_t> receive();
  /// The sender of the last packet is the peer.
  void pin_to_sender();
  /// The peer has to be learnt anew; without effect where it is the address's.
  void forget_peer();
  bool has_peer() const { return peer_ || !is_open(); }
  /// Sends what a serial port did not accept before.
  void flush();
  bool has_unsent() const { return !unsent_.empty(); }
  /// UDP packets that came from others than the peer and were dropped, and the address of the newest one's sender.
  std::int64_t strangers() const { return strangers_; }
  const std::string& newest_stranger() const { return newest_stranger_; }

 private:
  /// Of IPv4, in the order of the wire.
  struct Endpoint {
    std::uint32_t address = 0;
    std::uint16_t port = 0;
    bool operator==(const Endpoint&) const = default;
  };
  void shut(const std::string& why);
  bool send_packet(std::span<const std::uint8_t> packet);
  bool receive_packet(std::vector<std::uint8_t>& bytes);
  bool receive_piece(std::vector<std::uint8_t>& bytes);

  LinkAddress address_;
  FileDescriptor descriptor_;
  std::optional<Endpoint> peer_;
  Endpoint sender_;
  std::int64_t strangers_ = 0;
  std::string newest_stranger_;
  std::deque<std::uint8_t> unsent_;
  std::string problem_;
};

}  // namespace fbvins
