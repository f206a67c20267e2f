// SPDX-License-Identifier: Apache-2.0
// Cameras and IMUs that people have, by their data sheets and public calibrations (docs/experiments/simulator.md has the
// sources).
//
//   SimulationOptions options = *simulation_preset("handheld");
//   if (Result<void> used = use_sensors(options, "d435i"); !used) return used.error();
//
// Pure functions, any thread.
#pragma once

#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {

/// d435i, d435i-colour, oak-d, l515, phone, arducam-fc, adis16448.
std::vector<std::string> sensor_kits();

/// Sets whose sensors the options describe, and all figures of theirs; the flight, the place and the light stay.
Result<void> use_sensors(SimulationOptions& options, const std::string& name);

/// Cameras, their mounting, and the true noise of the IMU; euroc_rig() where there is no such kit.
StereoRig kit_rig(const std::string& name);

}  // namespace fbvins
