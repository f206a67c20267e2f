// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/socket_session.hpp"

#include <fmt/format.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace fbvins {
namespace {

/// Limit of one call of receive(), so that its owner can do other work.
constexpr int kMostMessagesAtOnce = 64;
/// Limit for emptying a connection that ends, as the sender may go on sending.
constexpr int kMostLeftOver = 1024;
constexpr int kMostDescriptors = 4;

}  // namespace

/// A message as it came, with the descriptors that came with it.
struct SocketSession::Packet {
  std::span<const std::byte> bytes;  ///< until the next one comes
  bool cut = false;                  ///< longer than any message
  std::vector<FileDescriptor> descriptors;
};

std::optional<SocketSession::Packet> SocketSession::next_packet() {
  iovec place{buffer_.data(), buffer_.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(kMostDescriptors * sizeof(int))> control;
  msghdr header{};
  header.msg_iov = &place;
  header.msg_iovlen = 1;
  header.msg_control = control.data();
  header.msg_controllen = control.size();
  ssize_t size = ::recvmsg(fd(), &header, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
  // ECONNRESET comes first where the sender has gone with unread messages; what it sent before follows.
  if (size < 0 && errno == ECONNRESET) size = ::recvmsg(fd(), &header, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return std::nullopt;
  Packet packet;
  for (cmsghdr* c = size < 0 ? nullptr : CMSG_FIRSTHDR(&header); c != nullptr; c = CMSG_NXTHDR(&header, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_RIGHTS) continue;
    std::array<int, kMostDescriptors> numbers{};
    const std::size_t bytes = std::min(c->cmsg_len - CMSG_LEN(0), sizeof(numbers));
    std::memcpy(numbers.data(), CMSG_DATA(c), bytes);
    for (std::size_t i = 0; i < bytes / sizeof(int); ++i) packet.descriptors.emplace_back(numbers[i]);
  }
  if (size <= 0) {
    if (ended_.empty()) ended_ = "left without a goodbye";
    return std::nullopt;
  }
  packet.bytes = std::span<const std::byte>(buffer_).first(static_cast<std::size_t>(size));
  packet.cut = (header.msg_flags & MSG_TRUNC) != 0;
  return packet;
}

void SocketSession::greet() {
  const auto packet = next_packet();
  if (!packet) return;
  take_hello(*packet);
}

void SocketSession::take_hello(const Packet& packet) {
  auto message = parse_socket_message(packet.bytes);
  if (!message) return fail(message.error());
  auto* hello = std::get_if<SocketHello>(&*message);
  if (!hello || packet.cut) return fail({ErrorCode::malformed, "the first message is not a hello"});
  if (packet.descriptors.size() != 1)
    return fail({ErrorCode::malformed, fmt::format("hello: {} file descriptors instead of one", packet.descriptors.size())});
  auto ring = FrameRing::map(packet.descriptors[0], hello->layout, wake_);
  if (!ring) return fail(ring.error());
  ring_ = *std::move(ring);
  hello_ = std::move(*hello);
}

void SocketSession::welcome() {
  send(FBVINS_SOCKET_WELCOME, FbvinsSocketWelcome{{}, FBVINS_SOCKET_MAJOR, FBVINS_SOCKET_MINOR, 0});
}

void SocketSession::receive(SensorInput& input) {
  for (int i = 0; i < kMostMessagesAtOnce && ended_.empty(); ++i) {
    const auto packet = next_packet();
    if (!packet) return;
    if (packet->cut) return fail({ErrorCode::malformed, "a message longer than any"});
    const auto message = parse_socket_message(packet->bytes);
    if (!message) return fail(message.error());
    take(*message, input);
  }
}

void SocketSession::take(const SocketMessage& message, SensorInput& input) {
  if (const auto* imu = std::get_if<SocketImu>(&message)) {
    for (const ImuSample& reading : imu->readings) input.push(reading);
    counts_.readings += imu->readings.size();
    counts_.readings_refused += static_cast<std::uint64_t>(imu->refused);
  } else if (const auto* frame = std::get_if<SocketFrame>(&message)) take(*frame, input);
  else if (const auto* position = std::get_if<SocketPosition>(&message)) take(*position, input);
  else if (const auto* aiding = std::get_if<SocketAiding>(&message)) take(*aiding, input);
  else if (const auto* device = std::get_if<SocketDevice>(&message)) device_ = device->facts;
  else if (const auto* goodbye = std::get_if<SocketGoodbye>(&message))
    ended_ = goodbye->text.empty() ? "said goodbye" : fmt::format("said goodbye: {}", goodbye->text);
  else if (std::holds_alternative<SocketHello>(message)) fail({ErrorCode::malformed, "a second hello"});
  else if (hello_->minor <= FBVINS_SOCKET_MINOR)  // else it is of a later version, which must do without an answer
    fail({ErrorCode::malformed, fmt::format("no message has type {}", std::get<SocketUnknown>(message).type)});
}

void SocketSession::take(const SocketPosition& position, SensorInput& input) {
  if (position.anchor) input.push_anchor(*position.anchor);
  else ++counts_.readings_refused;
}

void SocketSession::take(const SocketAiding& aiding, SensorInput& input) {
  if (aiding.reading) input.push_aiding(*aiding.reading);
  else ++counts_.readings_refused;
}

void SocketSession::take(const SocketFrame& frame, SensorInput& input) {
  Result<StereoFrame> taken = ring_->take(frame);
  if (!taken) return fail(taken.error());
  ++counts_.frames;
  if (last_sequence_ && frame.sequence > *last_sequence_) counts_.frames_missed += frame.sequence - *last_sequence_ - 1;
  last_sequence_ = frame.sequence;
  input.push(*std::move(taken));
}

bool SocketSession::send_released() {
  if (!ring_ || !ended_.empty()) return false;
  to_release_ |= ring_->released();
  if (to_release_ != 0 && send(FBVINS_SOCKET_RELEASED, FbvinsSocketReleased{{}, to_release_})) to_release_ = 0;
  return to_release_ != 0 && ended_.empty();
}

void SocketSession::send_status(std::uint32_t health, std::uint32_t reset_counter) {
  const auto held = static_cast<std::uint32_t>(ring_ ? ring_->held() : 0);
  send(
      FBVINS_SOCKET_STATUS,
      FbvinsSocketStatus{
          {}, counts_.frames, counts_.frames_missed, counts_.readings, counts_.readings_refused, held, health, reset_counter, 0});
}

bool SocketSession::send_map(const FbvinsSocketMap& map) {
  constexpr int kFirstMinor = 7;  // earlier senders know no such message
  return hello_->minor < kFirstMinor || send(FBVINS_SOCKET_MAP, map);
}

void SocketSession::fail(const Error& error) {
  refuse(error.code == ErrorCode::unsupported ? FBVINS_SOCKET_WRONG_VERSION : FBVINS_SOCKET_MALFORMED, error.message);
}

void SocketSession::refuse(std::uint32_t reason, const std::string& sentence) {
  FbvinsSocketGoodbye goodbye{};
  goodbye.reason = reason;
  sentence.copy(goodbye.text, sizeof(goodbye.text) - 1);
  send(FBVINS_SOCKET_GOODBYE, goodbye);
  ended_ = sentence;
  // Closing with unread messages would give the sender an error before the goodbye.
  ::shutdown(fd(), SHUT_WR);
  for (int i = 0; i < kMostLeftOver && next_packet(); ++i) {
  }
}

/// False when the sender does not read, or is gone, which the next receive() notices.
template <class Struct>
bool SocketSession::send(std::uint32_t type, Struct message) {
  message.header = {type, sizeof(message)};
  return ::send(fd(), &message, sizeof(message), MSG_DONTWAIT | MSG_NOSIGNAL) == static_cast<ssize_t>(sizeof(message));
}

}  // namespace fbvins
