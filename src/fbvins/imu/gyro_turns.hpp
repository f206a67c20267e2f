// SPDX-License-Identifier: Apache-2.0
// How the body turned by the gyroscope's readings, without bias, between any two moments of the last seconds.
//
//   GyroTurns turns;
//   turns.add(frame.imu, frame.t);                          // each segment, as it comes
//   const Quat turned = turns.between(a, b);                // R_ab
//
// One owner, one thread.
#pragma once

#include <deque>
#include <optional>

#include "fbvins/geometry/so3.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

class GyroTurns {
 public:
  /// Of a rate by orientations, to both sides: above the vibration of an airframe, below its motion.
  static constexpr Duration kRateOver{8'000'000};

  /// The readings of an image at `t` on the images' clock; the ends are left out: they are interpolated. False, and all before is
  /// forgotten, after a gap.
  bool add(const ImuSegment& segment, Time t);
  bool empty() const { return turned_.empty(); }
  Time first() const { return turned_.front().t; }
  Time last() const { return turned_.back().t; }
  void forget_before(Time t);

  /// Within what was added; not empty.
  Quat between(Time a, Time b) const { return (orientation(a).conjugate() * orientation(b)).normalized(); }
  /// Over twice kRateOver.
  Vec3 rate(Time t) const;

 private:
  struct Rotation {
    Time t;
    Quat q;  ///< of the readings since the first, without bias
  };
  void add_reading(Time t, const Vec3& rate);
  Quat orientation(Time t) const;

  std::deque<Rotation> turned_;
  std::optional<Vec3> last_rate_;
};

}  // namespace fbvins
