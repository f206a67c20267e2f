// SPDX-License-Identifier: Apache-2.0
// The pose at IMU rate: the newest estimate propagated with the readings since its image (eq. P5-P7), with its covariance.
// A new estimate restarts the propagation; the difference that it makes decays with a time constant, so that the output has no
// steps. It consists of the propagation's error and of the correction that the estimator publishes with this image, which is
// itself limited (Odometry). After a restart of the estimator W is new, and the pose changes at once.
//
//   PosePropagator propagator(rig.imu_noise, Duration::from_seconds(rig.time_offset_s), 0.1);
//   propagator.rebase(odometry);                  // whenever an image is estimated
//   LivePose pose = propagator.add(reading);      // every reading, in order of time
//
// Threads: one owner.
#pragma once

#include <deque>
#include <optional>

#include "fbvins/imu/nav_state.hpp"
#include "fbvins/live/live_event.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

class PosePropagator {
 public:
  /// time_offset: t_imu = t_image + offset.
  PosePropagator(const ImuNoise& noise, Duration time_offset, double smoothing_s, double gravity_mps2 = kGravity_mps2)
      : noise_(noise), time_offset_(time_offset), smoothing_s_(smoothing_s), gravity_mps2_(gravity_mps2) {}

  void rebase(const Odometry& estimate);
  /// The pose at this reading, with the health of the propagated estimate. Stamps must increase.
  LivePose add(const ImuSample& reading);

 private:
  /// `P` in the order of NavState; `t` is on the IMU's clock.
  struct Propagated {
    Time t;
    NavState state;
    Mat15 P = Mat15::Zero();
  };

  void advance(Propagated& p, const ImuSample& from, const ImuSample& to) const;
  Propagated propagate_all() const;
  ImuSample reading_at(Time t, const ImuSample& next) const;
  void decay_offset(double dt_s);

  ImuNoise noise_;
  Duration time_offset_;
  double smoothing_s_;
  double gravity_mps2_;
  std::deque<ImuSample> readings_;  ///< from the last one at or before the estimate's image on
  std::optional<Odometry> estimate_;
  std::optional<Propagated> newest_;  ///< at readings_.back(), or at a later estimate; none while there is no pose
  Vec15 offset_ = Vec15::Zero();      ///< published = newest (+) offset; biases have none
};

}  // namespace fbvins
