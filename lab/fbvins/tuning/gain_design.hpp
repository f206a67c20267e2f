// SPDX-License-Identifier: Apache-2.0
// Gains for an identified vehicle, from the innermost loop outwards: each loop settles as fast as the wanted phase margin, a gain
// margin of two and the largest overshoot allow. Pure functions.
//
//   Tuning tuning = tune(log, fit, {.phase_margin_deg = 55});
//   write(tuning.proposed);
#pragma once

#include <array>
#include <string>

#include "fbvins/tuning/plant_fit.hpp"

namespace fbvins {

struct TuneOptions {
  double phase_margin_deg = 50;  ///< least, of every loop
  double overshoot = 0.06;       ///< largest, of the predicted step response in angle or position
};

/// Range in which PX4 accepts a gain.
struct GainRange {
  double least, most;
};
/// Ranges of P, I, D and the outer loop's P. `loop`: roll, pitch, yaw, xy or z.
std::array<GainRange, 4> px4_ranges(const std::string& loop);

/// An inner loop (rate or velocity) and its outer loop (angle or position), as flown and as proposed.
struct LoopTuning {
  std::string name;
  StabilityMargins inner_before, outer_before, inner, outer;
  StepResponse before, after;  ///< predicted, in angle or position
  bool reachable = true;       ///< whether gains within PX4's ranges keep the margins
};

struct Tuning {
  VehicleFit fit;
  ControlOptions flown, proposed;
  std::array<LoopTuning, 5> loops;  ///< roll, pitch, yaw, xy, z
};

Tuning tune(const LoopLog& log, const VehicleFit& fit, const TuneOptions& options);

}  // namespace fbvins
