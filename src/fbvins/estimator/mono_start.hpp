// SPDX-License-Identifier: Apache-2.0
// The first states of a flight in motion with one camera (docs/derivations/alignment.md, O1-O8). Images of one camera have no
// scale; readings have. From tracks and readings together: the gyroscope's bias from the directions of the tracks, then velocity,
// gravity, accelerometer bias and the points as one linear problem, which needs no structure from motion before it.
//
//   std::optional<std::vector<NavState<G>>> states = start_with_one_camera(frames, T_BC, noise, biases, 9.81);
//   if (!states) wait_for_more_motion();
//
// Pure function.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fbvins/geometry/pose.hpp"
#include "fbvins/imu/nav_state.hpp"
#include "fbvins/types/imu_state.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// One state a frame, in a G that begins at the first one with z up; nothing where the motion does not determine them: too few
/// tracks, too little acceleration for a scale, or tracks and readings that do not agree. `biases`: their prior. Only the left
/// observations are used.
std::optional<std::vector<NavState<G>>> start_with_one_camera(std::span<const TrackedFrame> frames, const Pose<B, C0>& T_BC,
                                                              const ImuNoise& noise, const ImuBiasEstimate& biases,
                                                              double gravity_mps2);

/// Relative standard deviation of all lengths as a velocity shows it, with its covariance in the same axes; infinite at rest.
double scale_sigma_of(const Vec3& velocity, const Mat3& covariance);

}  // namespace fbvins
