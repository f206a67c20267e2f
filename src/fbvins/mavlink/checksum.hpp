// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

namespace fbvins {

/// CRC-16/MCRF4XX of a MAVLink frame without its first byte, then of the message's own seed byte.
inline std::uint16_t mavlink_checksum(std::span<const std::uint8_t> bytes, std::uint8_t crc_extra) {
  std::uint16_t crc = 0xffff;
  const auto add = [&crc](std::uint8_t byte) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = static_cast<std::uint16_t>((crc >> 1) ^ ((crc & 1) != 0 ? 0x8408 : 0));
  };
  for (const std::uint8_t byte : bytes) add(byte);
  add(crc_extra);
  return crc;
}

}  // namespace fbvins
