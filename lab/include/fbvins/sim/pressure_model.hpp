// SPDX-License-Identifier: Apache-2.0
// A barometer: the standard atmosphere, noise, a random walk, doors that open. Pure functions.
#pragma once

#include <vector>

#include "fbvins/sim/spline.hpp"
#include "fbvins/types/pressure.hpp"

namespace fbvins {

struct PressureModelOptions {
  double rate_hz = 0;
  double noise_pa = 1.5;
  double drift_pa_rts = 0.3;
  double door_every_s = 0;
  double door_pa = 30;
  double wrong_share = 0;

  template <class V>
  void visit(V&& v) {
    v("rate_hz", rate_hz, "Hz", "readings a second; 0: there is no barometer", 0.0, 1000.0);
    v("noise_pa", noise_pa, "Pa", "standard deviation of a reading; 12 Pa are a metre", 0.0, 1000.0);
    v("drift_pa_rts", drift_pa_rts, "Pa/sqrt(s)", "random walk of the pressure", 0.0, 100.0);
    v("door_every_s", door_every_s, "s", "a door opens for a second, on average as often; 0: none does", 0.0, 1e6);
    v("door_pa", door_pa, "Pa", "what it takes", -1000.0, 1000.0);
    v("wrong_share", wrong_share, "", "share of the readings that are anything", 0.0, 1.0);
  }
};

/// Stamps are the truth's.
std::vector<PressureSample> simulate_pressures(const SplineTrajectory& flight, const PressureModelOptions& options, Time start,
                                               std::uint64_t seed);

}  // namespace fbvins
