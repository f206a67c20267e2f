// SPDX-License-Identifier: Apache-2.0
// A lock between processes on a file (flock): atomic, and released by the kernel (or the file server) when the process ends in
// any way. The file itself stays. One owner.
//
//   Result<FileLock> lock = FileLock::take("out/locks/flight-klt", FileLock::Kind::alone, FileLock::Else::wait);
#pragma once

#include <string>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

class FileLock {
 public:
  enum class Kind { alone, shared };
  /// What to do while another process holds it.
  enum class Else { wait, refuse };

  /// Not held if, with `refuse`, another process holds it. ErrorCode::unwritable if the file cannot be opened or locked.
  static Result<FileLock> take(const std::string& path, Kind kind, Else otherwise);

  bool is_held() const { return static_cast<bool>(file_); }

 private:
  FileDescriptor file_;
};

}  // namespace fbvins
