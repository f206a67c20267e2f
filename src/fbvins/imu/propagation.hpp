// SPDX-License-Identifier: Apache-2.0
// Propagation of the state over a segment of readings, without covariance: for prediction between images.
//
//   NavState<G> now = propagate(state, frame.imu, gravity_G);
//
// Threads: pure functions. Same integration rule as Preintegration (eq. P5-P7).
#pragma once

#include "fbvins/imu/nav_state.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// State at the segment's last stamp; an empty segment returns the state unchanged. For F = G, W.
template <class F>
NavState<F> propagate(const NavState<F>& state, const ImuSegment& segment, const Vec3& gravity_F);

/// Rotation R_BiBj over the segment, gyro bias (rad/s) removed.
Quat integrate_gyro(const ImuSegment& segment, const Vec3& gyro_bias_radps);

}  // namespace fbvins
