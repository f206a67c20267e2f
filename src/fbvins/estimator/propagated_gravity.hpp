// SPDX-License-Identifier: Apache-2.0
// The direction up, through a restart or a contradiction: as the window knew it two seconds before its last good pose, carried on
// by the gyroscope. A start takes the tilt from the accelerometer, and where that is what failed, this is what contradicts it
// (docs/derivations/integrity.md, I14a).
//
//   up.carry(frame.t, frame.imu);                 every frame
//   up.take({...});                               after a good pose
//   up.hold();                                    images and readings contradict each other
//   up.restart();                                 the window is gone
//   if (auto d = up.difference(up_B, bias)) ...   of the window since
//
// One owner, one thread.
#pragma once

#include <deque>
#include <optional>

#include "fbvins/types/imu.hpp"

namespace fbvins {

class PropagatedGravity {
 public:
  struct Known {
    Vec3 up_B = Vec3::UnitZ();
    double sigma_rad = 0;
    Vec3 gyro_bias_radps = Vec3::Zero();
    double gyro_sigma_radps = 0;
  };

  /// Readings since the frame before. With a hole in them nothing is known any more.
  void carry(Time t, const ImuSegment& readings);
  void take(const Known& known);
  /// What is carried on is from before a contradiction that begins, until it is confirmed.
  void hold();
  void restart();
  /// The gyroscope cannot be relied on.
  void forget() { *this = {}; }
  struct Difference {
    Vec3 turn_B;                 ///< rotation vector in B from the up of the new window to the one carried on, rad
    bool contradiction = false;  ///< larger than what both may be wrong by (I14a)
  };
  /// After a restart, as long as that is remembered and not confirmed. `gyro_bias_radps`: of the new window; a gyroscope whose
  /// bias has moved carries nothing far.
  std::optional<Difference> difference(const Vec3& up_B, const Vec3& gyro_bias_radps) const;

 private:
  struct Entry {
    Time t;
    ImuSegment readings;  ///< that end there
    std::optional<Known> known;
  };
  void keep();

  std::deque<Entry> recent_;  ///< begins with a known one
  std::optional<Known> before_;
  bool restarted_ = false;  ///< since then
  Time since_, now_;        ///< of `before_`, and until when it was carried
};

}  // namespace fbvins
