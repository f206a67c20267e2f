// SPDX-License-Identifier: Apache-2.0
// The velocity, carried on by the readings from the last image that showed some of what had been seen before. Where all that is
// in view is new, images cannot tell a vehicle that moves from a thing before it that does; the readings can
// (docs/derivations/integrity.md, I14b).
//
//   velocity.carry(frame.imu);                    every frame
//   velocity.compare({...}, tracks_in_view(window));
//   if (velocity.contradicted()) ...              the images show another velocity
//
// One owner, one thread.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/core/ids.hpp"
#include "fbvins/imu/nav_state.hpp"

namespace fbvins {

class PropagatedVelocity {
 public:
  struct Known {
    NavState<G> state;
    Vec3 gravity_G = level_gravity();
    double velocity_sigma_mps = 0, tilt_sigma_rad = 0, gyro_bias_sigma_radps = 0, accel_bias_sigma_mps2 = 0;
  };

  /// Readings since the frame before. With a hole in them nothing is known any more.
  void carry(const ImuSegment& readings);
  /// The readings cannot be relied on.
  void forget();
  /// `seen`: tracks in the newest image that the newest state of the window, `now`, explains. `contradicted`: images and readings
  /// contradict each other.
  void compare(const Known& now, std::vector<TrackId> seen, bool contradicted = false);

  bool contradicted() const { return before_.has_value(); }
  /// By how much the velocity of the images is another one than the readings', m/s, and how far the pose has moved with it since
  /// that began, or since the last reset, m. Zero without a contradiction.
  const Vec3& velocity_G() const { return velocity_G_; }
  const Vec3& shift_G() const { return shift_G_; }
  /// A contradiction is over that has moved the pose by more than a good one may be wrong. True once.
  bool take_reset();
  /// Where the pose was is not told any more.
  void restart() { shift_G_.setZero(); }

 private:
  struct Carried {
    Known known;
    double seconds = 0;           ///< since then
    std::vector<TrackId> tracks;  ///< seen then, ascending

    void carry(const ImuSegment& readings);
    bool joins(const std::vector<TrackId>& seen) const;
    double sigma_mps() const;
  };
  void judge(const NavState<G>& now);
  bool over() const;

  std::optional<Carried> newest_;  ///< from the newest image that is joined to the one before
  std::optional<Carried> before_;  ///< from the one before a contradiction
  double begun_mps_ = 0;           ///< the difference of the velocities when it began
  Vec3 velocity_G_ = Vec3::Zero(), shift_G_ = Vec3::Zero();
};

}  // namespace fbvins
