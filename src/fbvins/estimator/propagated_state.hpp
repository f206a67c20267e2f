// SPDX-License-Identifier: Apache-2.0
// What was known before, carried on by the readings: up through a restart or a contradiction, the velocity through images in
// which all is new, and the covariances through a solve without any. Where the window contradicts it, the pose is not good and
// the difference is in the covariance (docs/derivations/integrity.md, I14a and I14b).
//
// One owner, one thread.
#pragma once

#include <optional>

#include "fbvins/estimator/propagated_gravity.hpp"
#include "fbvins/estimator/propagated_velocity.hpp"
#include "fbvins/estimator/sliding_window.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

class PropagatedState {
 public:
  /// Of the window after a solve, beside what it holds itself.
  struct Solved {
    const Odometry& odometry;  ///< covariances of the newest state
    Vec3 gravity_G;
    double up_sigma_rad = 0;
    bool clipped = false;         ///< readings at the end of the sensor's range
    bool contradicted = false;    ///< images and readings contradict each other
    bool bias_suspected = false;  ///< the accelerometer's bias moves farther than is usual
  };

  /// Readings since the frame before, of every frame.
  void carry(Time t, const ImuSegment& readings);
  /// With the newest state of the window.
  void compare(const SlidingWindow& window, const Solved& solved);
  /// After a frame is published: up, of a good pose.
  void remember(const SlidingWindow& window, const Odometry& published, bool clipped);
  /// The window is gone. `disputed`: images and readings contradicted each other, and which of them is wrong is unknown.
  void restart(bool disputed);
  /// The next start is disputed for another reason.
  void dispute() { disputed_ = true; }
  /// Another window begins.
  void begin_window();

  bool contradicted() const { return (tilt_away_ && tilt_away_->contradiction) || velocity_.contradicted() || unproven_s_ > 0; }
  /// A contradiction is over that has moved the pose by more than a good one may be wrong. True once.
  bool take_reset() { return velocity_.take_reset(); }

  /// Without a covariance from this solve, the last one; position grows by the velocity's error over the time since.
  /// NaN (unknown) if there never was one.
  void fill_covariances(Odometry& out);
  /// Adds what is contradicted to the covariances.
  void add_doubt(Odometry& out) const;

 private:
  struct Covariances {
    Time t;
    Mat6 pose;
    Mat3 velocity, gyro_bias, accel_bias;
  };

  PropagatedGravity up_;
  PropagatedVelocity velocity_;
  std::optional<PropagatedGravity::Difference>
      tilt_away_;                ///< of the window, from what was known before a restart or a contradiction
  bool doubted_before_ = false;  ///< readings or a bias, in the frame before
  bool disputed_ = false;        ///< the window before was
  double unproven_s_ = 0;        ///< so long images and readings have to agree in a new one
  double step_s_ = 0;            ///< of the newest frame
  Time now_;
  std::optional<Covariances> covariances_;  ///< of the newest state that had any
};

}  // namespace fbvins
