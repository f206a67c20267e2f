// SPDX-License-Identifier: Apache-2.0
// Keeps the times of MAVLink signatures growing over restarts, also on a computer whose clock begins anew: a file has a time
// that no signature has reached.
#pragma once

#include <cstdint>
#include <future>
#include <string>

#include "fbvins/core/atomic_file.hpp"

namespace fbvins {

class SigningTime {
 public:
  /// A file that is missing or damaged counts as zero.
  explicit SigningTime(std::string file, WriteFile write = write_file_atomically);

  /// Later than all signatures of the processes before.
  std::uint64_t first() const { return reserved_; }
  /// To be called with the newest signature's time: replaces the file before that reaches what the file says, about every half
  /// minute, on a thread of its own, because the sender of poses must not wait for a disk. False: the last attempt failed.
  bool keep(std::uint64_t time);
  const std::string& file() const { return file_; }

 private:
  std::string file_;
  WriteFile write_;
  std::uint64_t reserved_ = 0;  ///< what the file says, or will once pending_ is done
  std::future<bool> pending_;
  bool kept_ = true;
};

}  // namespace fbvins
