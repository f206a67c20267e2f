// SPDX-License-Identifier: Apache-2.0
// Simulated video devices for tests: this program's own open(), ioctl() and mmap() play the driver for paths that begin with
// /fake/.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "fbvins/core/time.hpp"

namespace fbvins {

/// One camera, plugged in during the object's lifetime. Any thread.
class FakeVideo {
 public:
  struct State;
  /// `formats`: those it offers. `most_width_px`: a larger width is reduced to this one, as drivers do.
  FakeVideo(const std::string& path, std::vector<std::uint32_t> formats, int most_width_px = 4096);
  ~FakeVideo();

  /// Fills the next buffer that the program has queued; false: there is none, or it does not stream.
  bool deliver(Time t, std::span<const std::uint8_t> bytes);
  void say_no_time();
  /// The next buffer is marked as damaged.
  void damage_next();
  bool streams() const;

 private:
  std::shared_ptr<State> state_;
};

}  // namespace fbvins
