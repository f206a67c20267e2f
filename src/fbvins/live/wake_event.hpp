// SPDX-License-Identifier: Apache-2.0
// Wakes a thread that waits in poll().
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <cstdint>

#include "fbvins/core/file_descriptor.hpp"

namespace fbvins {

/// signal() from any thread makes poll() on fd() return until clear().
class WakeEvent {
 public:
  WakeEvent() : event_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}

  int fd() const { return event_.number(); }
  void signal() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(fd(), &one, sizeof(one));  // fails only where it is signalled already
  }
  void clear() const {
    std::uint64_t count = 0;
    [[maybe_unused]] const auto taken = ::read(fd(), &count, sizeof(count));
  }

 private:
  FileDescriptor event_;
};

}  // namespace fbvins
