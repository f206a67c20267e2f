// SPDX-License-Identifier: Apache-2.0
// A lock that processes hold on a file: taken in one step by the kernel (or the file server), and gone with the process, however
// it ends. The file itself stays. One owner.
//
//   Result<FileLock> lock = FileLock::take("out/locks/flight-klt", FileLock::Kind::alone, FileLock::Else::wait);
#pragma once

#include <string>

#include "fbvins/core/result.hpp"

namespace fbvins {

class FileLock {
 public:
  enum class Kind { alone, shared };
  /// What to do while another holds it.
  enum class Else { wait, refuse };

  /// An error where the file cannot be opened, or, with `refuse`, another holds it (ErrorCode::unwritable).
  static Result<FileLock> take(const std::string& path, Kind kind, Else otherwise);

  FileLock() = default;
  ~FileLock();
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&& other) noexcept;
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  explicit FileLock(int file) : file_(file) {}

  int file_ = -1;
};

}  // namespace fbvins
