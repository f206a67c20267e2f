// SPDX-License-Identifier: Apache-2.0
// A sensor of velocity on the vehicle, such as optical flow with a known height, or wheels. Pure functions.
#pragma once

#include <vector>

#include "fbvins/sim/spline.hpp"
#include "fbvins/types/velocity.hpp"

namespace fbvins {

struct VelocityModelOptions {
  double rate_hz = 0;
  double noise_mps = 0.03;
  double scale_error = 0.005;
  bool vertical = false;
  double wrong_share = 0;

  template <class V>
  void visit(V&& v) {
    v("rate_hz", rate_hz, "Hz", "readings a second; 0: there is no sensor of velocity", 0.0, 1000.0);
    v("noise_mps", noise_mps, "m/s", "standard deviation of a reading along each axis", 0.0, 10.0);
    v("scale_error", scale_error, "", "all readings are too large by this share, 0.01 is 1 %", -0.5, 0.5);
    v("vertical", vertical, "", "it measures upwards, too, not ahead and aside alone");
    v("wrong_share", wrong_share, "", "share of the time, in pieces of a second, in which it slips: readings are half too large",
      0.0, 1.0);
  }
};

/// Readings 10 cm below the body, in the vehicle's axes (`R_BV`: x ahead and z up, in B). Stamps are the truth's.
std::vector<VelocitySample> simulate_velocities(const SplineTrajectory& flight, const Mat3& R_BV,
                                                const VelocityModelOptions& options, Time start, std::uint64_t seed);

}  // namespace fbvins
