// SPDX-License-Identifier: Apache-2.0
// The state of the body at one instant, and the 15-vector of its perturbation.
//
// Order everywhere: (p, theta, v, bg, ba), three numbers each. Position, velocity and biases are
// additive, rotation is right (local): R <- R * Exp(dtheta). p and v are in W. docs/conventions.md.
#pragma once

#include <Eigen/Core>

#include "fbvins/geometry/pose.hpp"
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

struct NavState {
  Pose<W, B> T_WB;
  Vec3 v_WB = Vec3::Zero();  ///< m/s, in W
  ImuBias bias;

  NavState boxplus(const Vec15& d) const {
    NavState s = *this;
    s.T_WB = T_WB.boxplus(d.segment<3>(nav::p), d.segment<3>(nav::theta));
    s.v_WB += d.segment<3>(nav::v);
    s.bias.gyro_radps += d.segment<3>(nav::bg);
    s.bias.accel_mps2 += d.segment<3>(nav::ba);
    return s;
  }

  /// The d with other.boxplus(d) == *this.
  Vec15 boxminus(const NavState& other) const {
    Vec15 d;
    d << T_WB.p - other.T_WB.p, so3_log(other.T_WB.q.conjugate() * T_WB.q), v_WB - other.v_WB,
        bias.gyro_radps - other.bias.gyro_radps, bias.accel_mps2 - other.bias.accel_mps2;
    return d;
  }
};

}  // namespace fbvins
