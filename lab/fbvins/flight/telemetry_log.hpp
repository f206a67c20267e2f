// SPDX-License-Identifier: Apache-2.0
// What a flight controller and its companion said to each other, as ground stations keep it (tlog): before each MAVLink frame its
// time in us, eight bytes, most significant first. One owner.
#pragma once

#include <cstdint>
#include <fstream>
#include <span>
#include <string>

namespace fbvins {

class TelemetryLog {
 public:
  /// False: the file cannot be written.
  bool open(const std::string& path);
  /// Whole frames, as packets have them; what is no MAVLink frame is left out. `t_us`: on the flight controller's clock.
  void add(std::span<const std::uint8_t> frames, std::uint64_t t_us);

 private:
  std::ofstream file_;
};

}  // namespace fbvins
