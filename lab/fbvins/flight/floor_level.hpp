// SPDX-License-Identifier: Apache-2.0
// What the floor tells of up. A vehicle that stands on its legs is level to a fifth of a degree; an odometry that has not turned
// yet takes a bias of its accelerometer for tilt, easily a degree or two, and is off by that share of every way it goes. While
// the odometry is less sure of up than the floor is, the mission's frame is levelled by the floor. One owner.
//
//   floor.rest(reading);                         // while it stands
//   floor.stand(heading_rad);                    // it takes off
//   Quat q = floor.correction(odometry);         // from W turned to the mission's heading, to level
//
// The tilt that the odometry ascribes to the standing vehicle follows from what its accelerometer read there and the bias that it
// believes in now; so the correction vanishes by itself where the odometry learns that bias in flight, and with it turns W.
#pragma once

#include "fbvins/sim/quadrotor.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

class FloorLevel {
 public:
  explicit FloorLevel(const Pose<BodyFlu, B>& mounting) : mounting_(mounting) {}

  void rest(const ImuSample& reading);
  /// `heading_rad`: of the vehicle in W.
  void stand(double heading_rad);
  /// After a restart nothing is known of how it stood.
  void forget() { standing_ = false; }

  /// In L, whose x was the vehicle's heading.
  Quat correction(const Odometry& odometry) const;

 private:
  Pose<BodyFlu, B> mounting_;
  Vec3 accel_V_ = Vec3::Zero();  ///< mean reading, in the vehicle's axes
  double heading_rad_ = 0;
  bool started_ = false, standing_ = false;
};

}  // namespace fbvins
