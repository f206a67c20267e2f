// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/range_model.hpp"

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "fbvins/core/rng.hpp"

namespace fbvins {

double distance_to(const std::vector<Facet>& facets, const Vec3& from, const Vec3& direction) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Facet& f : facets) {
    const Vec3 normal = f.u.cross(f.v);
    const double approach = normal.dot(direction);
    if (approach >= 0) continue;  // seen from behind, or along it
    const double distance = normal.dot(f.corner - from) / approach;
    if (distance <= 0 || distance >= nearest) continue;
    const Vec3 at = from + distance * direction - f.corner;
    const double a = at.cross(f.v).dot(normal) / normal.squaredNorm(), b = f.u.cross(at).dot(normal) / normal.squaredNorm();
    if (a >= 0 && a <= 1 && b >= 0 && b <= 1) nearest = distance;
  }
  return nearest;
}

std::vector<RangeSample> simulate_ranges(const SplineTrajectory& flight, const World& world, const Vec3& world_from_flight,
                                         const Mat3& R_BV, const RangeModelOptions& o, Time start, std::uint64_t seed) {
  std::vector<RangeSample> out;
  if (o.rate_hz == 0) return out;
  Rng rng(seed, 73);
  RangeSample beam;
  beam.direction_B = R_BV * -Vec3::UnitZ();
  beam.p_B = 0.03 * beam.direction_B;
  beam.sigma_m = std::hypot(o.noise_m, 1.5 * o.noise_share);
  beam.nearest_m = 0.05, beam.farthest_m = o.farthest_m;
  for (int k = 0; k / o.rate_hz < flight.duration_s(); ++k) {
    const double t = k / o.rate_hz;
    const auto T_WB = flight.pose(t);
    RangeSample reading = beam;
    reading.t = start + Duration::from_seconds(t);
    const double truth = distance_to(world.facets, T_WB * beam.p_B + world_from_flight, T_WB.q * beam.direction_B);
    const double noisy = truth + std::hypot(o.noise_m, o.noise_share * std::min(truth, o.farthest_m)) * rng.normal();
    const double anything = rng.uniform(0.1, o.farthest_m);
    reading.distance_m = rng.uniform(0, 1) < o.wrong_share ? anything
                         : o.step_m > 0                    ? o.step_m * std::round(noisy / o.step_m)
                                                           : noisy;
    if (!(reading.distance_m <= o.farthest_m)) reading.distance_m = std::numeric_limits<double>::infinity();
    out.push_back(reading);
  }
  return out;
}

}  // namespace fbvins
