// SPDX-License-Identifier: Apache-2.0
// One sender, from its hello to the end of its connection. No call blocks: the owner polls fd() and the wake. Whatever the sender
// does, at worst it ends its own session, with one sentence.
//
//   SocketSession session(accepted, wake);
//   session.greet();             // until greeted() or ended(): the hello, its memory mapped
//   session.welcome();           // the sender begins
//   session.receive(input);      // when fd() is readable, until ended()
//   session.send_released();     // when it was signalled
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "fbvins/live/frame_ring.hpp"
#include "fbvins/live/source.hpp"

namespace fbvins {

/// Counts of one connection.
struct SocketCounts {
  std::uint64_t frames = 0, frames_missed = 0, readings = 0, readings_refused = 0;
};

class SocketSession {
 public:
  SocketSession(FileDescriptor connection, std::shared_ptr<const WakeEvent> wake)
      : connection_(std::move(connection)), wake_(std::move(wake)) {}

  int fd() const { return connection_.number(); }
  /// For messages to people.
  std::string name() const { return hello_ ? hello_->name : "a sender"; }
  bool greeted() const { return hello_.has_value(); }
  const std::optional<SocketHello>& hello() const { return hello_; }
  /// Why the session is over; empty while it is not.
  const std::string& ended() const { return ended_; }
  const SocketCounts& counts() const { return counts_; }
  /// As the sender has last said.
  const std::optional<DeviceFacts>& device() const { return device_; }

  void greet();
  void welcome();
  /// Takes what has arrived, up to a number of messages.
  void receive(SensorInput& input);
  /// True when the message could not be sent yet, because the sender does not read.
  bool send_released();
  void send_status(std::uint32_t health, std::uint32_t reset_counter);
  /// False when it could not be sent yet, because the sender does not read.
  bool send_map(const FbvinsSocketMap& map);
  /// Sends the sender a goodbye with the reason, and ends the session.
  void refuse(std::uint32_t reason, const std::string& sentence);

 private:
  struct Packet;
  std::optional<Packet> next_packet();
  void take_hello(const Packet& packet);
  void take(const SocketMessage& message, SensorInput& input);
  void take(const SocketAiding& aiding, SensorInput& input);
  void take(const SocketPosition& position, SensorInput& input);
  void take(const SocketFrame& frame, SensorInput& input);
  void fail(const Error& error);
  template <class Struct>
  bool send(std::uint32_t type, Struct message);

  FileDescriptor connection_;
  std::array<std::byte, FBVINS_SOCKET_LARGEST_MESSAGE> buffer_;
  std::shared_ptr<const WakeEvent> wake_;
  std::optional<SocketHello> hello_;
  std::optional<DeviceFacts> device_;
  std::shared_ptr<FrameRing> ring_;
  std::optional<std::uint64_t> last_sequence_;
  std::uint64_t to_release_ = 0;
  SocketCounts counts_;
  std::string ended_;
};

}  // namespace fbvins
