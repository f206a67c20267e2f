// SPDX-License-Identifier: Apache-2.0
// How certain the newest state is: by the window, and by what calibrations leave open (docs/derivations/window.md, W16, W21-W23).
//
//   StateUncertainty uncertainty(scale_sigma, one_camera, 9.81);
//   uncertainty.fill(*solution.covariance(newest.id), newest, window.tilt(), mean_rate_B(window.frames()), odometry);
//
// One owner, one thread.
#pragma once

#include "fbvins/estimator/tilt.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

class StateUncertainty {
 public:
  /// `calibrated_scale_sigma`: relative, of all lengths; 0 with one camera.
  StateUncertainty(double calibrated_scale_sigma, bool one_camera, double gravity_mps2)
      : calibrated_scale_sigma_(calibrated_scale_sigma), one_camera_(one_camera), gravity_mps2_(gravity_mps2) {}

  /// A window begins.
  void restart() { up_sigma_rad_ = scale_sigma_ = velocity_sigma_mps_ = 0; }
  /// The covariances of the pose, the velocity and the biases, levelled, and scale_sigma. `covariance`: of the window's
  /// (p, theta, v, bg, ba, tilt); `mean_rate_B`: the turning rate in the window, rad/s.
  void fill(const Mat17& covariance, const NavState<G>& newest, const Tilt& tilt, const Vec3& mean_rate_B, Odometry& out);

  /// Of up's direction about its less certain axis.
  double up_sigma_rad() const { return up_sigma_rad_; }
  /// Of an axis.
  double velocity_sigma_mps() const { return velocity_sigma_mps_; }
  /// With one camera: relative standard deviation of the scale when the motion last showed it; otherwise 0.
  double scale_sigma() const { return scale_sigma_; }

 private:
  double calibrated_scale_sigma_;
  bool one_camera_;
  double gravity_mps2_;
  double up_sigma_rad_ = 0, scale_sigma_ = 0, velocity_sigma_mps_ = 0;
};

}  // namespace fbvins
