// SPDX-License-Identifier: Apache-2.0
// Files of maps and vocabularies: mapped for reading, replaced as a whole for writing, with a checksum.
// Functions without state; a MappedFile may be read by any number of threads.
//
//   Result<void> done = write_file_atomically("map.fbm", bytes);   // old or new file, whatever happens
//   auto file = MappedFile::open("map.fbm");
//   std::span<const std::byte> bytes = (*file)->bytes();
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

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

/// Writes beside the file, flushes to the disk, renames over it, flushes the folder. A kill or a power cut at any
/// moment leaves the old file or the new one, whole.
Result<void> write_file_atomically(const std::string& path, std::string_view bytes);

/// Checksum against damage, not against tampering: four multiplicative hashes side by side.
std::uint64_t checksum64(std::span<const std::byte> bytes);

}  // namespace fbvins
