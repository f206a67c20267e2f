// SPDX-License-Identifier: Apache-2.0
// Owners of what the kernel lends: a file descriptor, and a bell that wakes a thread in poll().
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <cstdint>
#include <utility>

namespace fbvins {

class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int number) : number_(number) {}
  FileDescriptor(FileDescriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~FileDescriptor() {
    if (number_ >= 0) ::close(number_);
  }

  int number() const { return number_; }
  explicit operator bool() const { return number_ >= 0; }

 private:
  int number_ = -1;
};

/// ring() from any thread makes poll() on fd() return until silence().
class Bell {
 public:
  Bell() : event_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}

  int fd() const { return event_.number(); }
  void ring() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(fd(), &one, sizeof(one));  // full: it rings already
  }
  void silence() const {
    std::uint64_t rung = 0;
    [[maybe_unused]] const auto taken = ::read(fd(), &rung, sizeof(rung));
  }

 private:
  FileDescriptor event_;
};

}  // namespace fbvins
