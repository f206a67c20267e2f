// SPDX-License-Identifier: Apache-2.0
// Private to bags: chunks as ROS and MCAP compress them. Pure functions, any thread.
//
//   Unpacked out = unpack("lz4", bytes, size, std::move(room));
//   if (!out.whole) ...              // out.bytes holds what came out before the damage, or the end
//   room = std::move(out.bytes);     // reused: a large new string costs time, for zeroing it and for its pages
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace fbvins {

struct Unpacked {
  std::string bytes;
  bool known = true;  ///< false: a compression of another name
  bool whole = false;
};

/// "", "none", "lz4" (frames), "bz2" or "zstd". `size` is that of the output, which is never larger; 0: unknown. Of either, at
/// most `largest_unpacked_bytes` are unpacked. The memory of `room` is reused.
Unpacked unpack(std::string_view compression, std::string_view bytes, std::uint64_t size, std::string room = {});

/// Whether a message of ROS 2 is one that rosbag2 has compressed: in CDR it would begin with a zero.
inline bool is_zstd(std::string_view bytes) { return bytes.starts_with("\x28\xB5\x2F\xFD"); }

inline bool is_plain(std::string_view compression) { return compression.empty() || compression == "none"; }

/// What a chunk of so many bytes may unpack to: a few kilobytes of zeros, compressed again and again, would keep the reader busy
/// for minutes. Images, also black ones, in the chunks that ROS and MCAP write, stay far below.
inline constexpr std::uint64_t largest_unpacked_bytes(std::uint64_t packed) {
  constexpr std::uint64_t kFree = std::uint64_t{16} << 20u, kRatio = 1000, kMost = std::uint64_t{256} << 20u;
  return packed > (kMost - kFree) / kRatio ? kMost : kFree + kRatio * packed;
}

}  // namespace fbvins
