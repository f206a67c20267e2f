// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>

#include "fbvins/core/result.hpp"

namespace fbvins {

/// Quality of service: resent until received or sent once; last values for late subscribers or none; length of the queue.
struct Ros2Quality {
  bool reliable = true;
  bool latched = false;  ///< ROS's transient_local
  int depth = 10;
};

/// What a user wants otherwise.
struct Ros2QualityWish {
  std::optional<bool> reliable, latched;
  std::optional<int> depth;
};
using Ros2QualityWishes = std::map<std::string, Ros2QualityWish>;  ///< by topic
/// "odometry=best_effort/1,/tf=volatile/10": topics as ROS names them ("/tf"), or the node's own without their first part.
Result<Ros2QualityWishes> parse_ros2_qos(const std::string& text);

}  // namespace fbvins
