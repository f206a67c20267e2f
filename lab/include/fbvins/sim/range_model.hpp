// SPDX-License-Identifier: Apache-2.0
// A rangefinder that looks down: a narrow beam against the world's surfaces, with noise. Pure functions.
#pragma once

#include <vector>

#include "fbvins/sim/imu_model.hpp"
#include "fbvins/sim/world.hpp"
#include "fbvins/types/range.hpp"

namespace fbvins {

struct RangeModelOptions {
  double rate_hz = 0;
  double noise_m = 0.01;
  double noise_share = 0.003;
  double step_m = 0.001;
  double farthest_m = 8;
  double wrong_share = 0;

  template <class V>
  void visit(V&& v) {
    v("rate_hz", rate_hz, "Hz", "readings a second; 0: there is no rangefinder", 0.0, 1000.0);
    v("noise_m", noise_m, "m", "standard deviation of a near reading", 0.0, 1.0);
    v("noise_share", noise_share, "", "and of the distance, 0.01 is 1 %", 0.0, 0.5);
    v("step_m", step_m, "m", "readings are multiples of this, 0: they are not", 0.0, 1.0);
    v("farthest_m", farthest_m, "m", "beyond it sees nothing", 0.1, 1000.0);
    v("wrong_share", wrong_share, "", "share of the readings that are anything", 0.0, 1.0);
  }
};

/// Distance along the beam to the nearest surface that faces it; infinite where there is none.
double distance_to(const std::vector<Facet>& facets, const Vec3& from, const Vec3& direction);

/// Readings of a beam from 3 cm below the body, down as the vehicle stands (`R_BV`: the vehicle's axes, x ahead and z up, in B).
/// Stamps are the truth's. `world_from_flight`: added to the flight's positions.
std::vector<RangeSample> simulate_ranges(const SplineTrajectory& flight, const World& world, const Vec3& world_from_flight,
                                         const Mat3& R_BV, const RangeModelOptions& options, Time start, std::uint64_t seed);

}  // namespace fbvins
