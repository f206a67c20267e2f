// SPDX-License-Identifier: Apache-2.0
// MAVLink 2 message signing: frames carry a time and a keyed hash, so that a sender without the key can neither make frames nor
// repeat old ones.
//
//   Result<MavlinkKey> key = parse_mavlink_key(text);
//   MavlinkSigner signer(*key, mavlink_signing_time(unix_time));
//   bytes = encode_mavlink(message, from, sequence, &signer);
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string_view>
#include <tuple>

#include "fbvins/core/result.hpp"
#include "fbvins/core/time.hpp"

namespace fbvins {

using MavlinkKey = std::array<std::uint8_t, 32>;

/// 64 hexadecimal digits, or the 32 bytes themselves. An error too where the program was built without nettle.
Result<MavlinkKey> parse_mavlink_key(std::string_view text);

/// Tens of microseconds since 2015-01-01, the unit of signatures; 0 for times before that.
std::uint64_t mavlink_signing_time(Time since_1970);

/// The key and the times of one connection. One thread at a time.
class MavlinkSigner {
 public:
  static constexpr std::size_t kBytes = 13;

  /// `time`: later than every time that was ever used with this key, or receivers will refuse the frames.
  MavlinkSigner(const MavlinkKey& key, std::uint64_t time) : key_(key), time_(time) {}

  /// The signature of a frame whose header says that it is signed, from its first byte up to its checksum.
  std::array<std::uint8_t, kBytes> sign(std::span<const std::uint8_t> frame);
  /// Whether the signature is of this key, and later than the sender's last one; of a sender not heard before, not more than a
  /// minute old.
  bool accept(std::span<const std::uint8_t> frame, std::span<const std::uint8_t, kBytes> signature);
  /// The clock has gone on. A clock that is behind changes nothing.
  void advance(std::uint64_t time) { time_ = time > time_ ? time : time_; }
  /// The newest time that was sent or accepted.
  std::uint64_t time() const { return time_; }

 private:
  /// System, component and link.
  using Stream = std::tuple<std::uint8_t, std::uint8_t, std::uint8_t>;

  MavlinkKey key_;
  std::uint64_t time_;
  std::map<Stream, std::uint64_t> newest_;
};

}  // namespace fbvins
