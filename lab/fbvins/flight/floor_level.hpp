// SPDX-License-Identifier: Apache-2.0
// The floor as a measurement of the vertical. A vehicle that stands on its legs is level to a fifth of a degree; an odometry that
// has not turned yet takes a bias of its accelerometer for tilt, easily a degree or two, and its positions are off by that share
// of every distance. While the odometry's tilt is less certain than the floor's, the mission's frame is levelled by the floor.
// One owner.
//
//   floor.stand(odometry);                          // it takes off
//   Quat q = floor.correction(odometry, q_LW);      // T_LW <- q * T_LW
//
// The direction of the standing vehicle's z is kept in the odometry's gauge, which is never turned, and carried
// into the present W. As the odometry's tilt becomes certain in flight, the correction fades.
#pragma once

#include <optional>

#include "fbvins/sim/quadrotor.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

class FloorLevel {
 public:
  explicit FloorLevel(const Pose<BodyFlu, B>& mounting) : z_B_(mounting.q.conjugate() * Vec3::UnitZ()) {}

  void stand(const Odometry& odometry) { z_G_ = odometry.gauge.T_GB.q * z_B_; }
  /// After a restart the gauge is another, and nothing is known of how it stood.
  void forget() { z_G_.reset(); }

  /// Turns directions of L, which q_LW makes of those of W.
  Quat correction(const Odometry& odometry, const Quat& q_LW) const;

 private:
  Vec3 z_B_;                 ///< the vehicle's z in the IMU's axes
  std::optional<Vec3> z_G_;  ///< of the vehicle that stood, in the gauge
};

}  // namespace fbvins
