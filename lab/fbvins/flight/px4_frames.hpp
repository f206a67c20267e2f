// SPDX-License-Identifier: Apache-2.0
// Conversions between a simulated vehicle (FLU) and the PX4 that flies it (FRD), and PX4's parameters. Pure functions, any
// thread.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "fbvins/flight/control_options.hpp"
#include "fbvins/flight/flight_controller.hpp"
#include "fbvins/mavlink/messages.hpp"
#include "fbvins/mavlink/mounting_options.hpp"

namespace fbvins {

/// N, PX4's local frame rotated half a turn about x: z is up.
struct Px4Local {};

/// Half a turn about x (FLU to FRD or back): of a vector, or of a rotation between two frames that are both turned.
Vec3 flu_to_frd(const Vec3& v);
Quat flu_to_frd(const Quat& q);

/// A mounting as options of `fbvins live`; `in_map`: with M for the local frame.
MountingOptions mounting_options_of(const Pose<BodyFlu, B>& mounting, bool in_map = false);

/// PX4's own estimate, in N (returned as L, with T_LN the identity).
VehicleEstimate estimate_of(const OdometryMessage& message);

/// Setpoint in PX4's local NED frame.
PositionTargetMessage target_message(const PathSetpoint& setpoint, const Pose<Local, Px4Local>& T_LN, std::uint32_t time_boot_ms);

HilSensorMessage sensor_message(const BoardReading& reading, std::uint64_t time_usec);
/// Adds height and its pressure in the standard atmosphere (ISA).
void add_height(HilSensorMessage& message, double height_m);

/// Names and values: no GPS, no magnetometer, vision as in docs/px4.md, this vehicle's rotors and gains.
using Px4Parameters = std::vector<std::pair<std::string, std::string>>;
Px4Parameters px4_parameters(const ControlOptions& control, const QuadrotorOptions& vehicle);

}  // namespace fbvins
