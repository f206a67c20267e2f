// SPDX-License-Identifier: Apache-2.0
// The bytes of a fuzz target in a file, for parsers that open their input by name. One for each process.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace fbvins::fuzz {

class NamedFile {
 public:
  explicit NamedFile(std::string_view extension)
      : path_((folder() / fmt::format("fbvins_fuzz_{}.{}", ::getpid(), extension)).string()) {}
  ~NamedFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  NamedFile(const NamedFile&) = delete;
  NamedFile& operator=(const NamedFile&) = delete;

  const std::string& with(std::string_view bytes) const {
    std::ofstream(path_, std::ios::binary | std::ios::trunc) << bytes;
    return path_;
  }

 private:
  /// In memory, where there is such a folder: a file on a disk is written thousands of times.
  static std::filesystem::path folder() {
    std::error_code ignored;
    return std::filesystem::is_directory("/dev/shm", ignored) ? "/dev/shm" : std::filesystem::temp_directory_path();
  }

  std::string path_;
};

}  // namespace fbvins::fuzz
