// SPDX-License-Identifier: Apache-2.0
// Receiver of the odometry's keyframes. Loop closure is one; the odometry knows it by this interface only.
//
//   MapUpdate update = mapper.process(keyframe);
//   Pose<M, B> T_MB = update.T_MW * odometry.T_WB;
#pragma once

#include "fbvins/types/keyframe.hpp"
#include "fbvins/types/loop.hpp"

namespace fbvins {

class Mapper {
 public:
  virtual ~Mapper() = default;

  /// Adds a keyframe to the map and returns the pose of W in it. Keyframes come in order of time, from one thread.
  virtual MapUpdate process(const Keyframe& keyframe) = 0;
};

}  // namespace fbvins
