// SPDX-License-Identifier: Apache-2.0
// The residual of a preintegrated interval between the states i and j, and its Jacobians
// (docs/derivations/preintegration.md, eq. P17-P24; paper 2.1.2).
//
//   Mat15 J_i, J_j;
//   Vec15 r = weighted_imu_residual(state_i, state_j, between, gravity_G, &J_i, &J_j);
//   cost += 0.5 * r.squaredNorm();
//
// F: the frame of both states; G in the window, M in a map, W in tests. Threads: pure functions (but see the cache of
// Preintegration::sqrt_information).
#pragma once

#include "fbvins/imu/nav_state.hpp"
#include "fbvins/imu/preintegration.hpp"

namespace fbvins {

/// r = (p, theta, v, bg, ba): p and v in B_i. Zero when j is what the readings predict from i.
template <class F>
Vec15 imu_residual(const NavState<F>& i, const NavState<F>& j, const Preintegration& between, const Vec3& gravity_F);

/// d r / d (perturbation of i), d r / d (perturbation of j), evaluated at the given states.
template <class F>
void imu_jacobians(const NavState<F>& i, const NavState<F>& j, const Preintegration& between, const Vec3& gravity_F, Mat15& J_i,
                   Mat15& J_j);

/// Residual with Jacobians (either may be null) at i_lin and j_lin: first estimates, for a consistent prior.
template <class F>
Vec15 imu_residual(const NavState<F>& i, const NavState<F>& j, const NavState<F>& i_lin, const NavState<F>& j_lin,
                   const Preintegration& between, const Vec3& gravity_F, Mat15* J_i, Mat15* J_j);

/// The same, with the Jacobians at the same states.
template <class F>
Vec15 imu_residual(const NavState<F>& i, const NavState<F>& j, const Preintegration& between, const Vec3& gravity_F, Mat15* J_i,
                   Mat15* J_j) {
  return imu_residual(i, j, i, j, between, gravity_F, J_i, J_j);
}

/// All multiplied by between.sqrt_information(): unit covariance.
template <class F>
Vec15 weighted_imu_residual(const NavState<F>& i, const NavState<F>& j, const NavState<F>& i_lin, const NavState<F>& j_lin,
                            const Preintegration& between, const Vec3& gravity_F, Mat15* J_i, Mat15* J_j);
template <class F>
Vec15 weighted_imu_residual(const NavState<F>& i, const NavState<F>& j, const Preintegration& between, const Vec3& gravity_F,
                            Mat15* J_i = nullptr, Mat15* J_j = nullptr) {
  return weighted_imu_residual(i, j, i, j, between, gravity_F, J_i, J_j);
}

}  // namespace fbvins
