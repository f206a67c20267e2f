// SPDX-License-Identifier: Apache-2.0
// A reading of a rangefinder: how far along its beam the next surface is. Each reading says where its beam begins and points, so
// that there may be several, and none needs an entry in the rig.
//
//   system.push(RangeSample{.t = t, .distance_m = 1.42, .p_B = Vec3(0, 0, -0.03), .direction_B = Vec3(0, 0, -1)});
#pragma once

#include <string>

#include "fbvins/core/time.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {

/// Along one beam, in B.
struct RangeSample {
  Time t;                                   ///< on the images' clock
  double distance_m = 0;                    ///< infinite or zero where it sees nothing
  double sigma_m = 0.02;                    ///< standard deviation
  Vec3 p_B = Vec3::Zero();                  ///< where the beam begins, m
  Vec3 direction_B = -Vec3::UnitZ();        ///< of length 1; down, of a body whose z is up
  double nearest_m = 0.1, farthest_m = 40;  ///< what the sensor can measure
};

/// What makes a reading unusable however good the sensor is, in words: a number that is not finite, a direction without a length.
/// Empty: nothing. That it sees nothing is not unusable.
std::string impossible(const RangeSample& reading);

}  // namespace fbvins
