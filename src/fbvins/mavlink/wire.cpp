// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mavlink/wire.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "fbvins/mavlink/checksum.hpp"
#include "fbvins/mavlink/payload.hpp"

namespace fbvins {
namespace {

constexpr std::uint8_t kMagic2 = 0xfd, kMagic1 = 0xfe;
constexpr std::uint8_t kSigned = 0x01;  // MAVLINK_IFLAG_SIGNED
constexpr std::size_t kSignatureBytes = MavlinkSigner::kBytes, kChecksumBytes = 2;

constexpr bool begins_frame(std::uint8_t byte) { return byte == kMagic2 || byte == kMagic1; }

/// A frame's header.
struct Head {
  std::size_t payload_at = 0, payload_size = 0, frame_size = 0;
  std::uint32_t id = 0;
  MavlinkAddress from;
  std::uint8_t sequence = 0;
  bool readable = true;
};

/// None while the bytes do not contain all of it.
std::optional<Head> read_head(std::span<const std::uint8_t> bytes) {
  Head head;
  head.payload_at = bytes[0] == kMagic2 ? 10 : 6;
  if (bytes.size() < head.payload_at) return std::nullopt;
  head.payload_size = bytes[1];
  head.frame_size = head.payload_at + head.payload_size + kChecksumBytes;
  if (bytes[0] == kMagic1) {
    head.sequence = bytes[2], head.from = {bytes[3], bytes[4]}, head.id = bytes[5];
    return head;
  }
  if ((bytes[2] & kSigned) != 0) head.frame_size += kSignatureBytes;
  head.readable = (bytes[2] & ~kSigned) == 0;
  head.sequence = bytes[4], head.from = {bytes[5], bytes[6]};
  head.id = static_cast<std::uint32_t>(bytes[7]) | static_cast<std::uint32_t>(bytes[8]) << 8 |
            static_cast<std::uint32_t>(bytes[9]) << 16;
  return head;
}

/// Calls `known` with a default message of this id and returns true; false where the id is unknown.
template <class F, std::size_t... I>
bool with_message(std::uint32_t id, F&& known, std::index_sequence<I...>) {
  const auto try_one = [&](auto message) { return message.kId == id && (known(message), true); };
  return (try_one(std::variant_alternative_t<I, MavlinkMessage>{}) || ...);
}

template <class F>
bool with_message(std::uint32_t id, F&& known) {
  return with_message(id, std::forward<F>(known), std::make_index_sequence<std::variant_size_v<MavlinkMessage>>{});
}

}  // namespace

std::vector<std::uint8_t> encode_mavlink(const MavlinkMessage& message, MavlinkAddress from, std::uint8_t sequence,
                                         MavlinkSigner* signer) {
  return std::visit(
      [&](auto fields) {
        PayloadWriter payload;
        fields.wire(payload);
        auto& bytes = payload.bytes();
        while (bytes.size() > 1 && bytes.back() == 0) bytes.pop_back();
        const auto id = fields.kId;
        PayloadWriter frame;
        const std::uint8_t flags = signer != nullptr ? kSigned : std::uint8_t{0};
        frame(std::array<std::uint8_t, 7>{kMagic2, static_cast<std::uint8_t>(bytes.size()), flags, 0, sequence, from.system,
                                          from.component});
        frame(std::array<std::uint8_t, 3>{static_cast<std::uint8_t>(id), static_cast<std::uint8_t>(id >> 8),
                                          static_cast<std::uint8_t>(id >> 16)});
        for (const std::uint8_t byte : bytes) frame(byte);
        frame(mavlink_checksum(std::span(frame.bytes()).subspan(1), fields.kCrcExtra));
        if (signer != nullptr) frame(signer->sign(frame.bytes()));
        return std::move(frame.bytes());
      },
      message);
}

bool MavlinkDecoder::is_signed(std::span<const std::uint8_t> frame) const {
  if (frame[0] != kMagic2 || (frame[2] & kSigned) == 0) return false;
  return signer_->accept(frame.first(frame.size() - kSignatureBytes), frame.last<kSignatureBytes>());
}

/// Number of bytes consumed; 0: more are needed.
std::size_t MavlinkDecoder::step(std::span<const std::uint8_t> bytes, std::vector<MavlinkFrame>& frames) {
  const auto begin = std::find_if(bytes.begin(), bytes.end(), begins_frame) - bytes.begin();
  if (begin > 0) {
    counts_.noise_bytes += begin;
    return static_cast<std::size_t>(begin);
  }
  const std::optional<Head> head = read_head(bytes);
  if (head && !head->readable) return ++counts_.noise_bytes, 1;
  if (!head || bytes.size() < head->frame_size) return 0;

  const auto payload = bytes.subspan(head->payload_at, head->payload_size);
  const std::size_t crc_at = head->payload_at + head->payload_size;
  bool good = false;
  const bool known = with_message(head->id, [&](auto& message) {
    const auto wanted = mavlink_checksum(bytes.subspan(1, crc_at - 1), message.kCrcExtra);
    good = wanted == (bytes[crc_at] | bytes[crc_at + 1] << 8);
    if (!good) return;
    if (signer_ != nullptr && !is_signed(bytes.first(head->frame_size))) return void(++counts_.unsigned_frames);
    ++counts_.frames;
    PayloadReader reader(payload);
    message.wire(reader);
    frames.push_back({head->from, head->sequence, message});
  });
  if (good) return head->frame_size;
  // A frame whose checksum cannot be judged is accepted where another follows it, or nothing yet.
  if (!known && (bytes.size() == head->frame_size || begins_frame(bytes[head->frame_size])))
    return ++counts_.skipped, head->frame_size;
  if (known) ++counts_.bad_checksum;
  return ++counts_.noise_bytes, 1;
}

std::vector<MavlinkFrame> MavlinkDecoder::push(std::span<const std::uint8_t> bytes) {
  std::vector<MavlinkFrame> frames;
  pending_.insert(pending_.end(), bytes.begin(), bytes.end());
  std::span<const std::uint8_t> rest = pending_;
  while (!rest.empty()) {
    const std::size_t done = step(rest, frames);
    if (done == 0) break;
    rest = rest.subspan(done);
  }
  pending_.erase(pending_.begin(), pending_.end() - static_cast<std::ptrdiff_t>(rest.size()));
  return frames;
}

}  // namespace fbvins
