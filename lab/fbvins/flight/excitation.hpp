// SPDX-License-Identifier: Apache-2.0
// What is flown to be told apart afterwards: along x, y and z and about the vertical, one after the other, a swing that gets
// faster (a chirp), no wider than a quarter of a metre. Pure functions.
#pragma once

#include "fbvins/flight/position_controller.hpp"

namespace fbvins {

/// Seconds.
double excitation_length_s();
/// The setpoint `t_s` after it began, around a place where the vehicle hovers.
PathSetpoint excited(const PathSetpoint& hover, double t_s);

}  // namespace fbvins
