// SPDX-License-Identifier: Apache-2.0
// A reading of a sensor of velocity: wheels, optical flow over a known height, a Doppler sensor. Each reading says where the
// sensor sits and how its axes lie, so that there may be several, and none needs an entry in the rig.
//
//   system.push(VelocitySample{.t = t, .v_mps = Vec3(0.8, 0, 0), .sigma_mps = Vec3(0.05, 0.05, kUnmeasured_mps)});
#pragma once

#include <string>

#include "fbvins/core/time.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {

/// The standard deviation of a velocity along an axis that a sensor does not measure; larger ones are taken for it.
inline constexpr double kUnmeasured_mps = 100;

/// Of the point at which the sensor sits, over the ground, in the sensor's axes.
struct VelocitySample {
  Time t;  ///< on the images' clock
  Vec3 v_mps = Vec3::Zero();
  Vec3 sigma_mps = Vec3::Constant(0.05);  ///< standard deviations along the axes; kUnmeasured_mps where it measures nothing
  Vec3 p_B = Vec3::Zero();                ///< where the sensor sits, m
  Quat q_BS = Quat::Identity();           ///< takes its axes to B's
};

/// What makes a reading unusable however good the sensor is, in words. Empty: nothing.
std::string impossible(const VelocitySample& reading);

}  // namespace fbvins
