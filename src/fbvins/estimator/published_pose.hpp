// SPDX-License-Identifier: Apache-2.0
// The published pose. It follows the window's newest pose, levelled, and never jumps: corrections by the window are not
// published at once but stay pending, and are applied by at most a fixed step with every frame
// (docs/derivations/window.md, W17-W20).
//
//   published.follow(motion, level.T_FB);    // motion of the body since the frame before, by the IMU; its pose, levelled
//   published.fill(level, odometry);
//
// A value; the same calls give the same bits.
#pragma once

#include <optional>

#include "fbvins/core/angle.hpp"
#include "fbvins/imu/nav_state.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

/// Ratio of the limits on corrections of attitude and of position: 0.1 degrees for 3 mm.
inline constexpr double kRotationPerStep_radpm = 0.1 * (3.14159265358979323846 / 180) / 0.003;

/// Likewise for corrections that are too large for a good pose: 3 degrees for 10 cm.
inline constexpr double kRotationPending_radpm = 3 * kDegree / 0.1;

class PublishedPose {
 public:
  /// Largest correction of the position per frame, and the largest that a good pose may owe; 0: no limit.
  PublishedPose(double max_step_m, double max_pending_m) : max_step_m_(max_step_m), max_pending_m_(max_pending_m) {}

  /// A new W begins: the next pose is published as the window has it.
  void restart() { started_ = false, tilt_sigma_rad_ = 0; }
  /// The next frame. Without `motion` since the last one its pose is published as the window has it.
  void follow(const std::optional<Pose<B, B>>& motion, const Pose<W, B>& level);
  /// Fills pose, velocity, up and tilt; adds the pending correction to the covariances in `out`, which are of the level state.
  void fill(const NavState<W>& level, Odometry& out);

  /// The pending correction is larger than a pose called good may be wrong; or so many times as large.
  bool pending_too_large(double times = 1) const {
    const double most_m = times * max_pending_m_;
    return max_step_m_ > 0 && max_pending_m_ > 0 &&
           (pending_.head<3>().norm() > most_m || pending_.tail<3>().norm() > kRotationPending_radpm * most_m);
  }

  const Pose<W, B>& T_WB() const { return T_WB_; }
  /// Pending correction (dp in W [m], dtheta in B [rad]): from the published to the level pose.
  const Vec6& pending() const { return pending_; }

 private:
  double max_step_m_, max_pending_m_;
  bool started_ = false;
  Pose<W, B> T_WB_;
  Vec6 pending_ = Vec6::Zero();
  double tilt_sigma_rad_ = 0;  ///< from the last covariance
};

}  // namespace fbvins
