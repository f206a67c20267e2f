// SPDX-License-Identifier: Apache-2.0
// A reading of a barometer: how high the body is over where it was, as long as weather, doors and the vehicle's own wind let it.
//
//   system.push(PressureSample{.t = t, .pressure_pa = 101'260});
#pragma once

#include <string>

#include "fbvins/core/time.hpp"

namespace fbvins {

struct PressureSample {
  Time t;                  ///< on the images' clock
  double pressure_pa = 0;  ///< absolute
  double sigma_pa = 2;     ///< standard deviation; 12 Pa are a metre
};

/// What makes a reading unusable however good the sensor is, in words. Empty: nothing.
std::string impossible(const PressureSample& reading);

}  // namespace fbvins
