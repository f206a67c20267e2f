// SPDX-License-Identifier: Apache-2.0
// How the body turned by the gyroscope's readings, without bias, between any two moments of the last seconds.
//
//   GyroTurns turns;
//   turns.add(frame.imu);                                   // each segment, as it comes
//   const Quat turned = turns.between(a, b);                // R_ab
//
// One owner, one thread.
#pragma once

#include <deque>
#include <optional>

#include "fbvins/geometry/so3.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// How the body turns near a moment, rad/s and rad/s^2.
struct TurnAround {
  Vec3 rate, gain;

  /// So much later.
  Vec3 after(double s) const { return s * rate + 0.5 * s * s * gain; }
};

class GyroTurns {
 public:
  /// To both sides of a moment, at least and at most: above the vibration of an airframe, below its motion.
  static constexpr Duration kLeastSide{8'000'000}, kMostSide{20'000'000};

  /// The ends are left out: they are interpolated.
  void add(const ImuSegment& segment);
  void clear();
  bool empty() const { return turned_.empty(); }
  Time first() const { return turned_.front().t; }
  Time last() const { return turned_.back().t; }
  void forget_before(Time t);
  /// Whether it is known how the body turned between any two moments from a to b.
  bool covers(Time a, Time b) const;

  /// Within what is covered.
  Quat between(Time a, Time b) const { return (orientation(a).conjugate() * orientation(b)).normalized(); }
  /// A parabola through the turns on both sides, which vibration does not disturb.
  TurnAround around(Time t, Duration side) const;

 private:
  struct Rotation {
    Time t;
    Quat q;  ///< of the readings since the first, without bias
  };
  void add_reading(Time t, const Vec3& rate);
  Quat orientation(Time t) const;
  std::size_t not_before(Time t) const;
  struct Gap {
    Time from, to;
  };

  std::deque<Rotation> turned_;
  std::deque<Gap> gaps_;
  std::optional<Vec3> last_rate_;
};

}  // namespace fbvins
