// SPDX-License-Identifier: Apache-2.0
// Between a simulated vehicle (forward-left-up) and a PX4 that flies it (forward-right-down), and what PX4 has to be told before.
// Pure functions, any thread.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "fbvins/flight/control_options.hpp"
#include "fbvins/flight/flight_controller.hpp"
#include "fbvins/mavlink/messages.hpp"
#include "fbvins/mavlink/mounting_options.hpp"

namespace fbvins {

/// PX4's local frame: x as its heading has it, z down.
struct Px4Local {};

/// y and z the other way round, of a vector or a rotation between two frames of which both are turned.
Vec3 turned_over(const Vec3& v);
Quat turned_over(const Quat& q);

/// A mounting as `fbvins live` is told it.
MountingOptions mounting_options_of(const Pose<BodyFlu, B>& mounting);

/// PX4's own pose, its local frame turned over so that z is up.
VehicleEstimate estimate_of(const OdometryMessage& message);

/// `T_LN`: from PX4's local frame, turned over.
PositionTargetMessage target_message(const PathSetpoint& setpoint, const Pose<Local, Px4Local>& T_LN, std::uint32_t time_boot_ms);

HilSensorMessage sensor_message(const BoardReading& reading, std::uint64_t time_usec);
/// The height as the pressure of a standard atmosphere.
void add_height(HilSensorMessage& message, double height_m);

/// Names and values: no GPS, no magnetometer, vision as docs/px4.md has it, this vehicle's rotors and gains.
using Px4Parameters = std::vector<std::pair<std::string, std::string>>;
Px4Parameters px4_parameters(const ControlOptions& control, const QuadrotorOptions& vehicle);

}  // namespace fbvins
