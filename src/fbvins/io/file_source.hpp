// SPDX-License-Identifier: Apache-2.0
// Files of a dataset, whether they lie in a folder or in a zip archive that stays packed.
// One thread at a time.
//
//   Result<std::unique_ptr<FileSource>> files = open_file_source("MH_01_easy.zip");
//   Result<std::string> csv = (*files)->read("mav0/cam0/data.csv");
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"

namespace fbvins {

/// What a person can do who gives a ROS bag where only EuRoC recordings and flight records are read.
inline constexpr const char* kAboutRosBags = "ROS bags are read by fbvins-bags; `fbvins convert` makes a EuRoC folder of one";

class FileSource {
 public:
  virtual ~FileSource() = default;
  /// True for a plain file at this path (with '/', relative to the folder or the archive).
  virtual bool exists(const std::string& path) const = 0;
  /// The whole file; an error for more than max_bytes.
  virtual Result<std::string> read(const std::string& path, std::uint64_t max_bytes) const = 0;
  /// Folders ("" or ending in '/') that hold a file `tail`, for example "cam0/data.csv".
  virtual std::vector<std::string> folders_holding(const std::string& tail) const = 0;
  /// How a person would name that file.
  virtual std::string describe(const std::string& path) const = 0;
  virtual bool packed() const = 0;
};

/// A folder or a zip archive, recognised by content.
Result<std::unique_ptr<FileSource>> open_file_source(const std::string& path);

/// The whole of a plain file outside of any dataset.
Result<std::string> read_file(const std::string& path, std::uint64_t max_bytes);

}  // namespace fbvins
