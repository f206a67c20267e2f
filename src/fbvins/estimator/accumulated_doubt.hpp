// SPDX-License-Identifier: Apache-2.0
// What contradictions between images and readings leave in doubt about position and heading: the turns and shifts by which the
// images' pose differed from the readings', added up with their squares since the last reset (docs/derivations/integrity.md, I8
// and I9). A value.
#pragma once

#include "fbvins/geometry/pose.hpp"
#include "fbvins/types/gauge.hpp"

namespace fbvins {

class AccumulatedDoubt {
 public:
  /// A pose that the images turned by `turn_B` and shifted by `shift_G` against the one predicted by the readings.
  void add(const Pose<G, B>& predicted, const Vec3& turn_B, const Vec3& shift_G);
  /// The position may have moved by as much in each direction.
  void add_position(double sigma_m) { shifts_G_ += sigma_m * sigma_m * Mat3::Identity(); }
  void clear() { *this = {}; }

  /// Too large for a pose that is called good.
  bool large() const;
  /// Of (dp in G [m], dtheta in B [rad]) at this pose.
  Mat6 covariance(const Pose<G, B>& T_GB) const;
  /// Of this velocity, in G.
  Mat3 velocity_covariance(const Vec3& v_GB) const;

 private:
  Mat3 turns() const { return turns_G_ + turn_G_ * turn_G_.transpose(); }

  Vec3 turn_G_ = Vec3::Zero(), shift_G_ = Vec3::Zero();    ///< seen minus predicted, added up
  Mat3 turns_G_ = Mat3::Zero(), shifts_G_ = Mat3::Zero();  ///< their squares, added up
  Vec3 where_G_ = Vec3::Zero();                            ///< where the turn began
};

}  // namespace fbvins
