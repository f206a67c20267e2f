// SPDX-License-Identifier: Apache-2.0
// Gains for a vehicle whose response is known: each loop as fast as a stated phase margin, half a turn away from a gain of two,
// and little overshoot allow, from the innermost outwards. Pure functions.
//
//   Tuning tuning = tune(log, fit, {.phase_margin_deg = 55});
//   write(tuning.proposed);
#pragma once

#include <array>
#include <string>
#include <vector>

#include "fbvins/tuning/plant_fit.hpp"

namespace fbvins {

struct TuneOptions {
  double phase_margin_deg = 50;  ///< of every loop, at least
  double overshoot = 0.06;       ///< of a step in angle or place, predicted, at most
};

/// Between which PX4 takes a gain.
struct GainRange {
  double least, most;
};
/// Of P, I, D and the gain of the loop around them; loop: roll, pitch, yaw, xy or z.
std::array<GainRange, 4> px4_ranges(const std::string& loop);

/// One loop and the one around it, as flown and as proposed.
struct LoopTuning {
  std::string name;
  Margins inner_before, outer_before, inner, outer;
  StepResponse before, after;  ///< predicted, of a step in angle or place
  bool reachable = true;       ///< the margins can be kept within PX4's ranges
};

struct Tuning {
  VehicleFit fit;
  ControlOptions flown, proposed;
  std::array<LoopTuning, 5> loops;  ///< roll, pitch, yaw, xy, z
};

Tuning tune(const LoopLog& log, const VehicleFit& fit, const TuneOptions& options);

}  // namespace fbvins
