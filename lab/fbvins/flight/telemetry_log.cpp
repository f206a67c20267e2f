// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/telemetry_log.hpp"

#include <array>

namespace fbvins {
namespace {

constexpr std::uint8_t kVersion1 = 0xfe, kVersion2 = 0xfd, kSigned = 1;
constexpr std::size_t kAround1 = 8, kAround2 = 12, kSignature = 13;

/// Bytes of the frame at the beginning; 0: there is none.
std::size_t frame_size(std::span<const std::uint8_t> bytes) {
  if (bytes.size() >= 3 && bytes[0] == kVersion2) return bytes[1] + kAround2 + ((bytes[2] & kSigned) != 0 ? kSignature : 0);
  if (bytes.size() >= 2 && bytes[0] == kVersion1) return bytes[1] + kAround1;
  return 0;
}

}  // namespace

bool TelemetryLog::open(const std::string& path) {
  file_.open(path, std::ios::binary | std::ios::trunc);
  return file_.good();
}

void TelemetryLog::add(std::span<const std::uint8_t> frames, std::uint64_t t_us) {
  if (!file_.is_open()) return;
  std::array<char, 8> stamp{};
  for (std::size_t i = 0; i < stamp.size(); ++i) stamp[i] = static_cast<char>(t_us >> 8 * (7 - i) & 0xff);
  while (!frames.empty()) {
    const std::size_t size = frame_size(frames);
    if (size == 0 || size > frames.size()) return;
    file_.write(stamp.data(), stamp.size());
    file_.write(reinterpret_cast<const char*>(frames.data()), static_cast<std::streamsize>(size));
    frames = frames.subspan(size);
  }
}

}  // namespace fbvins
