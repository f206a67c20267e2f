// SPDX-License-Identifier: Apache-2.0
// Video devices for tests, where the kernel has none: this program's own open(), ioctl() and mmap() stand in for a driver at
// paths that begin with /fake/.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "fbvins/core/time.hpp"

namespace fbvins {

/// One camera; it is plugged in as long as it lives. Any thread.
class FakeVideo {
 public:
  struct State;
  /// `formats`: what it offers. `most_width_px`: a larger image is cut to this width, as drivers do.
  FakeVideo(const std::string& path, std::vector<std::uint32_t> formats, int most_width_px = 4096);
  ~FakeVideo();

  /// Fills the next buffer that the program has given; false: there is none, or it does not stream.
  bool deliver(Time t, std::span<const std::uint8_t> bytes);
  void say_no_time();
  /// The next buffer is marked as damaged.
  void damage_next();
  bool streams() const;

 private:
  std::shared_ptr<State> state_;
};

}  // namespace fbvins
