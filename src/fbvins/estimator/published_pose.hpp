// SPDX-License-Identifier: Apache-2.0
// The pose that leaves the estimator. It follows the window's newest pose, turned level, and never leaps: what the window
// corrects is not shown at once but stays pending, and is applied by at most a fixed step with every frame
// (docs/derivations/window.md, W17-W20).
//
//   published.follow(motion, level.T_WB);    // the body's motion since the frame before by its IMU; where it is, turned level
//   published.fill(level, odometry);
//
// A value; the same calls give the same bits.
#pragma once

#include <optional>

#include "fbvins/imu/nav_state.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

/// Attitude is corrected by 0.1 degrees at most where position is by 3 mm.
inline constexpr double kTurnPerStep_radpm = 0.1 * (3.14159265358979323846 / 180) / 0.003;

class PublishedPose {
 public:
  /// What a frame may apply of it; 0: all at once.
  explicit PublishedPose(double max_step_m) : max_step_m_(max_step_m) {}

  /// Nothing has been published in this W: the next pose is where the window says.
  void restart() { started_ = false; }
  /// The next frame. Without `motion` nothing is known of the way since the last one.
  void follow(const std::optional<Pose<B, B>>& motion, const Pose<W, B>& level);
  /// Pose, velocity and what is known of up; the covariances in `out`, of the level state, get what is still pending.
  void fill(const NavState& level, Odometry& out);

  const Pose<W, B>& T_WB() const { return T_WB_; }
  /// (dp in W [m], dtheta in B [rad]) from what is published to the level pose.
  const Vec6& pending() const { return pending_; }

 private:
  double max_step_m_;
  bool started_ = false;
  Pose<W, B> T_WB_;
  Vec6 pending_ = Vec6::Zero();
  double tilt_sigma_rad_ = 0;  ///< as of the last covariance
};

}  // namespace fbvins
