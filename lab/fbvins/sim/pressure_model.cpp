// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/pressure_model.hpp"

#include <cmath>

#include "fbvins/core/rng.hpp"

namespace fbvins {

std::vector<PressureSample> simulate_pressures(const SplineTrajectory& flight, const PressureModelOptions& o, Time start,
                                               std::uint64_t seed) {
  constexpr double kGround_pa = 101'325, kScaleHeight_m = 8434, kDoor_s = 1;
  std::vector<PressureSample> out;
  if (o.rate_hz == 0) return out;
  Rng rng(seed, 75);
  double drift_pa = 0, door_until_s = 0;
  for (int k = 0; k / o.rate_hz < flight.duration_s(); ++k) {
    const double t = k / o.rate_hz;
    drift_pa += o.drift_pa_rts / std::sqrt(o.rate_hz) * rng.normal();
    if (rng.uniform(0, 1) * o.rate_hz * o.door_every_s < 1 && o.door_every_s > 0) door_until_s = t + kDoor_s;
    PressureSample reading{start + Duration::from_seconds(t), 0, std::max(o.noise_pa, 0.1)};
    reading.pressure_pa = kGround_pa * std::exp(-flight.pose(t).p.z() / kScaleHeight_m) + drift_pa + o.noise_pa * rng.normal();
    if (t < door_until_s) reading.pressure_pa -= o.door_pa;
    const double anything = rng.uniform(95'000, 105'000);
    if (rng.uniform(0, 1) < o.wrong_share) reading.pressure_pa = anything;
    out.push_back(reading);
  }
  return out;
}

}  // namespace fbvins
