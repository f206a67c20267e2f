// SPDX-License-Identifier: Apache-2.0
// Files of maps and vocabularies: mapped for reading, with a checksum (written by core/atomic_file.hpp).
// Functions without state; a MappedFile may be read by any number of threads.
//
//   auto file = MappedFile::open("map.fbm");
//   std::span<const std::byte> bytes = (*file)->bytes();
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "fbvins/core/result.hpp"

namespace fbvins {

/// A file mapped into memory, read-only, until destroyed.
class MappedFile {
 public:
  static Result<std::shared_ptr<const MappedFile>> open(const std::string& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  MappedFile() = default;
  std::span<const std::byte> bytes_;
};

/// Checksum against damage, not against tampering: four multiplicative hashes side by side.
std::uint64_t checksum64(std::span<const std::byte> bytes);

}  // namespace fbvins
