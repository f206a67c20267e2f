// SPDX-License-Identifier: Apache-2.0
// A trajectory as a function of time with exact derivatives: uniform B-splines of degree 5 (position
// four times continuously differentiable, rotation likewise on its cumulative form). Immutable, any thread.
//
//   SplineTrajectory flight(0.1, positions, rotations);   // seconds from knot to knot
//   MotionState m = flight.at(2.5);                       // seconds from the start
//   Vec3 f_B = m.specific_force();                        // what an ideal accelerometer reads
#pragma once

#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/geometry/bspline_basis.hpp"
#include "fbvins/geometry/pose.hpp"

namespace fbvins {

/// Magnitude of gravity, m/s^2 (EuRoC's convention; the estimator's default).
inline constexpr double kSimGravity_mps2 = 9.81;

/// The motion of a rigid body at an instant.
struct MotionState {
  Pose<W, B> T_WB;
  Vec3 v_WB = Vec3::Zero();     ///< m/s, in W
  Vec3 a_WB = Vec3::Zero();     ///< m/s^2, in W
  Vec3 j_WB = Vec3::Zero();     ///< jerk, m/s^3, in W
  Vec3 w_WB_B = Vec3::Zero();   ///< rad/s, in B
  Vec3 dw_WB_B = Vec3::Zero();  ///< angular acceleration, rad/s^2, in B

  /// Reading of an ideal accelerometer, in B.
  Vec3 specific_force(double gravity_mps2 = kSimGravity_mps2) const {
    return T_WB.q.conjugate() * (a_WB + Vec3(0, 0, gravity_mps2));
  }
};

class SplineTrajectory {
 public:
  SplineTrajectory() = default;
  /// Control points, one per knot, at least six. Time 0 is the start of the interval of the first six.
  SplineTrajectory(double knot_spacing_s, std::vector<Vec3> positions, std::vector<Quat> rotations);

  double duration_s() const { return (static_cast<double>(positions_.size()) - 5) * dt_; }
  /// Times outside of [0, duration] are clamped to it.
  MotionState at(double t_s) const;
  Pose<W, B> pose(double t_s) const;

 private:
  struct Place {
    std::size_t first;  ///< control point
    double u;           ///< in [0, 1)
  };
  Place place(double t_s) const;

  double dt_ = 1;
  std::vector<Vec3> positions_;
  std::vector<Quat> rotations_;
  std::vector<Vec3> steps_;  ///< Log(q_i^-1 q_i+1), rad
};

}  // namespace fbvins
