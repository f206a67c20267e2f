// SPDX-License-Identifier: Apache-2.0
// The floor as a measurement of the vertical. A standing vehicle is level to a fifth of a degree. Before any rotation the
// odometry cannot tell an accelerometer bias from tilt: its W may be tilted by a degree or two, and positions are wrong by that
// share of each distance. The mission's frame is therefore levelled by the floor, weighted by the two tilt variances.
// One owner.
//
//   floor.stand(odometry);                          // at take-off
//   Quat q = floor.correction(odometry, q_LW);      // T_LW <- q * T_LW
//
// The z axis of the standing vehicle is kept in the odometry's gauge frame, which never rotates, and transformed
// into the current W. The correction fades as the odometry's tilt variance decreases in flight.
#pragma once

#include <optional>

#include "fbvins/sim/quadrotor.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

class FloorLevel {
 public:
  explicit FloorLevel(const Pose<BodyFlu, B>& mounting) : z_B_(mounting.q.conjugate() * Vec3::UnitZ()) {}

  void stand(const Odometry& odometry) { z_G_ = odometry.gauge.T_GB.q * z_B_; }
  /// After a restart: the gauge is new and its vertical was not measured.
  void forget() { z_G_.reset(); }

  /// Rotation to apply to L after q_LW; identity if the floor was not measured.
  Quat correction(const Odometry& odometry, const Quat& q_LW) const;

 private:
  Vec3 z_B_;                 ///< the vehicle's z axis in B
  std::optional<Vec3> z_G_;  ///< of the standing vehicle, in the gauge frame
};

}  // namespace fbvins
