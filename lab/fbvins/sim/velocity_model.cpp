// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/velocity_model.hpp"

#include <cmath>

#include "fbvins/core/rng.hpp"

namespace fbvins {

std::vector<VelocitySample> simulate_velocities(const SplineTrajectory& flight, const Mat3& R_BV, const VelocityModelOptions& o,
                                                Time start, std::uint64_t seed) {
  constexpr double kBelow_m = 0.1, kSlips = 1.5, kPiece_s = 1;
  std::vector<VelocitySample> out;
  if (o.rate_hz == 0) return out;
  Rng rng(seed, 74);
  VelocitySample sensor;
  sensor.q_BS = Quat(R_BV);
  sensor.p_B = R_BV * Vec3(0, 0, -kBelow_m);
  sensor.sigma_mps = Vec3::Constant(std::max(o.noise_mps, 1e-3));
  if (!o.vertical) sensor.sigma_mps.z() = kUnmeasured_mps;
  bool slips = false;
  for (int k = 0; k / o.rate_hz < flight.duration_s(); ++k) {
    const double t = k / o.rate_hz;
    if (k == 0 || std::floor(t / kPiece_s) != std::floor((k - 1) / o.rate_hz / kPiece_s))
      slips = rng.uniform(0, 1) < o.wrong_share;
    const MotionState at = flight.at(t);
    const Vec3 v_B = at.T_WB.q.conjugate() * at.v_WB + at.w_WB_B.cross(sensor.p_B);
    VelocitySample reading = sensor;
    reading.t = start + Duration::from_seconds(t);
    reading.v_mps = (1 + o.scale_error) * (slips ? kSlips : 1) * (sensor.q_BS.conjugate() * v_B);
    for (int i = 0; i < 3; ++i) reading.v_mps(i) += o.noise_mps * rng.normal();
    if (!o.vertical) reading.v_mps.z() = 0;
    out.push_back(reading);
  }
  return out;
}

}  // namespace fbvins
