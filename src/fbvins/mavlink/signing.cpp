// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mavlink/signing.hpp"

#include <algorithm>
#include <charconv>
#include <cstring>

#ifdef FBVINS_WITH_NETTLE
#include <nettle/sha2.h>
#endif

namespace fbvins {
namespace {

constexpr std::uint64_t kTimeLimit = std::uint64_t{1} << 48, kOldest = 6'000'000;  // a minute
constexpr std::size_t kTimeAt = 1, kTimeBytes = 6, kHashAt = 7, kHashBytes = 6;
constexpr std::size_t kSystemAt = 5, kComponentAt = 6;

/// The first 48 bits of the SHA-256 of key, frame, link and time.
std::array<std::uint8_t, kHashBytes> keyed_hash(const MavlinkKey& key, std::span<const std::uint8_t> frame,
                                                std::span<const std::uint8_t> link_and_time) {
  std::array<std::uint8_t, kHashBytes> hash{};
#ifdef FBVINS_WITH_NETTLE
  sha256_ctx context;
  sha256_init(&context);
  for (const std::span<const std::uint8_t> part : {std::span<const std::uint8_t>(key), frame, link_and_time})
    sha256_update(&context, part.size(), part.data());
  sha256_digest(&context, hash.size(), hash.data());
#else
  (void)key, (void)frame, (void)link_and_time;
#endif
  return hash;
}

std::uint64_t time_of(std::span<const std::uint8_t> signature) {
  std::uint64_t time = 0;
  for (std::size_t i = kTimeBytes; i-- > 0;) time = time << 8 | signature[kTimeAt + i];
  return time;
}

/// In a time that does not depend on where they differ.
bool same(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b) {
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference |= static_cast<unsigned>(a[i] ^ b[i]);
  return difference == 0;
}

std::string_view without_space_at_the_end(std::string_view text) {
  while (!text.empty() && std::strchr(" \t\r\n", text.back()) != nullptr) text.remove_suffix(1);
  return text;
}

}  // namespace

Result<MavlinkKey> parse_mavlink_key(std::string_view text) {
#ifndef FBVINS_WITH_NETTLE
  (void)text;
  return Error{ErrorCode::unsupported, "this program was built without nettle, which MAVLink signing needs"};
#else
  MavlinkKey key{};
  if (text.size() == key.size()) {
    std::copy(text.begin(), text.end(), key.begin());
    return key;
  }
  const Error bad{ErrorCode::invalid_argument, "a MAVLink key is 64 hexadecimal digits, or 32 bytes"};
  text = without_space_at_the_end(text);
  if (text.size() != 2 * key.size()) return bad;
  for (std::size_t i = 0; i < key.size(); ++i) {
    const char* begin = text.data() + 2 * i;
    if (const auto [end, error] = std::from_chars(begin, begin + 2, key[i], 16); error != std::errc() || end != begin + 2)
      return bad;
  }
  return key;
#endif
}

std::uint64_t mavlink_signing_time(Time since_1970) {
  constexpr std::int64_t kBegin_s = 1'420'070'400, kNsPerTick = 10'000;
  return static_cast<std::uint64_t>(std::max<std::int64_t>(since_1970.ns / kNsPerTick - kBegin_s * 100'000, 0));
}

std::array<std::uint8_t, MavlinkSigner::kBytes> MavlinkSigner::sign(std::span<const std::uint8_t> frame) {
  if (time_ + 1 < kTimeLimit) ++time_;
  std::array<std::uint8_t, kBytes> signature{};
  for (std::size_t i = 0; i < kTimeBytes; ++i) signature[kTimeAt + i] = static_cast<std::uint8_t>(time_ >> 8 * i);
  const auto hash = keyed_hash(key_, frame, std::span(signature).first(kHashAt));
  std::copy(hash.begin(), hash.end(), signature.begin() + kHashAt);
  return signature;
}

bool MavlinkSigner::accept(std::span<const std::uint8_t> frame, std::span<const std::uint8_t, kBytes> signature) {
  if (frame.size() <= kComponentAt || !same(keyed_hash(key_, frame, signature.first(kHashAt)), signature.subspan(kHashAt)))
    return false;
  const std::uint64_t time = time_of(signature);
  const auto [stream, is_new] = newest_.try_emplace({frame[kSystemAt], frame[kComponentAt], signature[0]}, time);
  if (is_new && time + kOldest < time_) return newest_.erase(stream), false;
  if (!is_new && time <= stream->second) return false;
  stream->second = time;
  advance(time);
  return true;
}

}  // namespace fbvins
