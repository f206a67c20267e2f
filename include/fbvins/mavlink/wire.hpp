// SPDX-License-Identifier: Apache-2.0
// MAVLink 2 frames: encoded, and decoded from a byte stream that may begin anywhere and contain anything.
//
//   MavlinkDecoder decoder;
//   for (const MavlinkFrame& frame : decoder.push(bytes_from_the_cable))
//     if (const auto* beat = std::get_if<HeartbeatMessage>(&frame.message)) ...
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "fbvins/mavlink/messages.hpp"
#include "fbvins/mavlink/signing.hpp"

namespace fbvins {

/// Sender of a message; the defaults are ours: the vehicle's system id, and MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY.
struct MavlinkAddress {
  std::uint8_t system = 1, component = 197;
  bool operator==(const MavlinkAddress&) const = default;
};

/// One frame, signed where a signer is given; zeros at the payload's end are left out as the protocol requires.
std::vector<std::uint8_t> encode_mavlink(const MavlinkMessage& message, MavlinkAddress from, std::uint8_t sequence,
                                         MavlinkSigner* signer = nullptr);

struct MavlinkFrame {
  MavlinkAddress from;
  std::uint8_t sequence = 0;
  MavlinkMessage message;
};

/// Reads MAVLink 2, and 1, which flight controllers send until they receive a message. Messages that are not of MavlinkMessage
/// are skipped with their checksum unchecked, as that takes their definition. With a signer, frames that are not signed with its
/// key are refused, those of MAVLink 1 among them; without one signatures are not looked at.
class MavlinkDecoder {
 public:
  explicit MavlinkDecoder(MavlinkSigner* signer = nullptr) : signer_(signer) {}

  struct Counts {
    std::int64_t frames = 0;           ///< returned
    std::int64_t skipped = 0;          ///< of other messages
    std::int64_t bad_checksum = 0;     ///< frames of known messages
    std::int64_t unsigned_frames = 0;  ///< refused: no signature, or one that is not accepted
    std::int64_t noise_bytes = 0;      ///< not of any frame
  };

  /// The frames that end within these bytes, in order. An incomplete frame is kept for the next call: at most 300 bytes.
  std::vector<MavlinkFrame> push(std::span<const std::uint8_t> bytes);
  /// Drops a half-read frame: what comes next does not continue it.
  void restart() { pending_.clear(); }
  const Counts& counts() const { return counts_; }

 private:
  std::size_t step(std::span<const std::uint8_t> bytes, std::vector<MavlinkFrame>& frames);
  bool is_signed(std::span<const std::uint8_t> frame) const;
  MavlinkSigner* signer_;
  std::vector<std::uint8_t> pending_;
  Counts counts_;
};

}  // namespace fbvins
