// SPDX-License-Identifier: Apache-2.0
// Where the body was in the odometry's gauge at any time of the last seconds: at keyframes as estimated, between them by the
// IMU's readings, whose error at the later keyframe is spread over the way (docs/derivations/loop.md, L21). One thread at a time.
//
//   motion.add(keyframe);                                    // every keyframe of a gauge
//   std::optional<Pose<G, B>> T_GB = motion.at(anchor.t);
#pragma once

#include <deque>
#include <optional>

#include "fbvins/imu/imu_history.hpp"
#include "fbvins/imu/nav_state.hpp"
#include "fbvins/types/keyframe.hpp"

namespace fbvins {

class RecentMotion {
 public:
  void add(const Keyframe& keyframe);
  /// Nothing before the keyframes of the last seconds, after the newest, and where readings are missing.
  std::optional<Pose<G, B>> at(Time t) const;
  Time newest() const { return keyframes_.back().t; }

 private:
  struct Known {
    Time t;
    NavState<G> state;
    Vec3 gravity_G;
  };
  std::deque<Known> keyframes_;
  ImuHistory readings_;
};

}  // namespace fbvins
