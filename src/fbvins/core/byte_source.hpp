// SPDX-License-Identifier: Apache-2.0
// Private: bytes at any place of a file, or of memory in tests. Any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "fbvins/core/result.hpp"

namespace fbvins {

class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;
  /// Up to `count` bytes from `offset`; fewer where the source ends or cannot be read.
  std::string read(std::uint64_t offset, std::uint64_t count) const {
    std::string out;
    fill(out, offset, count);
    return out;
  }
  /// The same, into a string whose memory is reused; its former content is lost.
  virtual void fill(std::string& out, std::uint64_t offset, std::uint64_t count) const = 0;
};

/// Of a plain file, its size taken now.
Result<std::shared_ptr<ByteSource>> open_bytes(const std::string& path);
std::shared_ptr<ByteSource> bytes_in_memory(std::string bytes);

}  // namespace fbvins
