// SPDX-License-Identifier: Apache-2.0
// Excitation for system identification: chirps along x, y and z and in yaw, one after the other, with an amplitude of at most
// a quarter of a metre. Pure functions.
#pragma once

#include "fbvins/flight/position_controller.hpp"

namespace fbvins {

/// Duration of all four chirps, s.
double excitation_length_s();
/// The setpoint `t_s` after the beginning, around a hover setpoint.
PathSetpoint excitation_setpoint(const PathSetpoint& hover, double t_s);

}  // namespace fbvins
