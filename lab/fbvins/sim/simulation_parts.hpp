// SPDX-License-Identifier: Apache-2.0
// Shared by rendered recordings and SensorStation. Pure functions unless said otherwise.
#pragma once

#include "fbvins/sim/flight_recorder.hpp"
#include "fbvins/sim/frame_times.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {

inline constexpr Time kSimulationStart{1'700'000'000'000'000'000};  ///< stamp of a synthetic flight's first IMU sample

/// Renders the stereo frame at t_s after `start`; frames in order.
RenderedFrame render_at(FlightRecorder& recorder, const StereoRig& rig, double t_s, std::int64_t frame, bool with_depth = false,
                        Time start = kSimulationStart);

}  // namespace fbvins
