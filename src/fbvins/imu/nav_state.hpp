// SPDX-License-Identifier: Apache-2.0
// The state of the body at one instant, and the 15-vector of its perturbation.
//
//   NavState<G> state = window.newest().state;                    // in the gauge frame
//   NavState<W> level = window.tilt().levelled(state);            // the same, levelled
//
// Order everywhere: (p, theta, v, bg, ba), three numbers each. Position, velocity and biases are
// additive, rotation is right (local): R <- R * Exp(dtheta). p and v are in the state's frame. docs/conventions.md.
#pragma once

#include <Eigen/Core>

#include "fbvins/geometry/pose.hpp"
#include "fbvins/types/gauge.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

using Vec15 = Eigen::Matrix<double, 15, 1>;
using Mat15 = Eigen::Matrix<double, 15, 15>;

/// Magnitude of gravity.
inline constexpr double kGravity_mps2 = 9.81;

/// Gravity in a world whose z is up, m/s^2.
inline Vec3 level_gravity(double gravity_mps2 = kGravity_mps2) { return {0, 0, -gravity_mps2}; }

/// Where each block of a 15-vector begins.
namespace nav {
inline constexpr int p = 0, theta = 3, v = 6, bg = 9, ba = 12;
}

/// F: the frame that the state is in. G in the estimator's window, W where it is published, M in a map.
template <class F>
struct NavState {
  Pose<F, B> T_FB;
  Vec3 v_FB = Vec3::Zero();  ///< m/s, in F
  ImuBias bias;

  /// The velocity in the body's axes.
  Vec3 v_B() const { return T_FB.q.conjugate() * v_FB; }

  NavState boxplus(const Vec15& d) const {
    NavState s = *this;
    s.T_FB = T_FB.boxplus(d.segment<3>(nav::p), d.segment<3>(nav::theta));
    s.v_FB += d.segment<3>(nav::v);
    s.bias.gyro_radps += d.segment<3>(nav::bg);
    s.bias.accel_mps2 += d.segment<3>(nav::ba);
    return s;
  }

  /// The d with other.boxplus(d) == *this.
  Vec15 boxminus(const NavState& other) const {
    Vec15 d;
    d << T_FB.p - other.T_FB.p, so3_log(other.T_FB.q.conjugate() * T_FB.q), v_FB - other.v_FB,
        bias.gyro_radps - other.bias.gyro_radps, bias.accel_mps2 - other.bias.accel_mps2;
    return d;
  }
};

}  // namespace fbvins
