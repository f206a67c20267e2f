// SPDX-License-Identifier: Apache-2.0
// The pose at IMU rate: the newest estimate propagated with the readings since its image (eq. P1), with its covariance.
// A new estimate restarts the propagation; the difference that it makes decays with a time constant, so that the output has no
// steps. It consists of the propagation's error and of the correction that the estimator publishes with this image, which is
// itself limited (Odometry). After a restart of the estimator W is new, and the pose changes at once.
//
//   PosePropagator propagator(assumed_noise(rig.imu_noise, options), Duration::from_seconds(rig.time_offset_s), 0.1);
//   propagator.rebase(odometry);                                 // whenever an image is estimated
//   if (std::optional<LivePose> pose = propagator.add(reading))  // every reading, in order of time
//
// Threads: one owner.
#pragma once

#include <optional>

#include "fbvins/imu/imu_history.hpp"
#include "fbvins/imu/preintegration.hpp"
#include "fbvins/live/live_event.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

class PosePropagator {
 public:
  /// noise: with which the estimator weights the readings. time_offset: t_imu = t_image + offset.
  PosePropagator(const ImuNoise& noise, Duration time_offset, double smoothing_s, double gravity_mps2 = kGravity_mps2)
      : noise_(noise),
        given_offset_(time_offset),
        time_offset_(time_offset),
        smoothing_s_(smoothing_s),
        gravity_mps2_(gravity_mps2),
        readings_(noise, time_offset) {}

  /// Where no reading has reached the estimate's image, because the IMU is silent: the pose at the image.
  std::optional<LivePose> rebase(const Odometry& estimate);
  /// The pose at this reading, with the health of the propagated estimate; nothing for a reading that is refused (ReadingJudge).
  std::optional<LivePose> add(const ImuSample& reading);

 private:
  void propagate_to(Time t);
  NavState<W> estimated_state() const { return {estimate_->T_WB, estimate_->v_WB, estimate_->bias}; }
  NavState<W> newest_state() const;
  LivePose newest_pose(Time t, const Vec3& gyro_radps) const;
  void correct_time_offset(Duration by);
  void decay_offset(double dt_s);

  ImuNoise noise_;
  Duration given_offset_, time_offset_;
  double smoothing_s_;
  double gravity_mps2_;
  ImuHistory readings_;  ///< from the last one at or before the estimate's image on
  std::optional<Odometry> estimate_;
  std::optional<Preintegration> since_;  ///< from the estimate's image to `newest_t_`; none while there is no pose
  Time newest_t_;
  Vec15 offset_ = Vec15::Zero();  ///< published = propagated (+) offset; biases have none
};

}  // namespace fbvins
