// SPDX-License-Identifier: Apache-2.0
// Which program flies a simulated vehicle.
#pragma once

#include <string>

namespace fbvins {

struct ControllerProgram {
  enum class Kind {
    own,        ///< Autopilot
    px4,        ///< a real PX4: bin/px4 of a px4_sitl build
    ardupilot,  ///< a real ArduPilot: arducopter of a SITL build
  };
  Kind kind = Kind::own;
  std::string binary;
  std::string folder;   ///< for its parameters and logs; deleted and created at the start
  bool in_map = false;  ///< a real flight controller gets poses in M (docs/px4.md)
};

}  // namespace fbvins
