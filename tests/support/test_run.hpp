// SPDX-License-Identifier: Apache-2.0
// For tests: a run with known errors.
#pragma once

#include <cmath>

#include "fbvins/core/rng.hpp"
#include "fbvins/report/run_folder.hpp"

namespace fbvins {

/// A circle, ten seconds at 20 Hz. The estimate starts at the truth, in a frame rotated by `yaw` and translated; its errors
/// are white noise of its covariance's standard deviation times `share`.
inline RunFolder circling_run(double share, double yaw = 0.7, std::uint64_t seed = 5) {
  constexpr double kSigma_m = 0.01, kSigma_rad = 0.002, kSigma_mps = 0.03, kSigma_bg = 1e-3, kSigma_ba = 2e-2;
  Rng rng(seed);
  const auto noise = [&](double sigma) {
    const double x = rng.normal(), y = rng.normal(), z = rng.normal();
    return Vec3(share * sigma * x, share * sigma * y, share * sigma * z);
  };
  const Pose<W, W> w_from_truth(so3_exp(Vec3(0, 0, yaw)), Vec3(3, -2, 1));
  RunFolder run;
  run.name = "circle-klt";
  run.dataset = "circle";
  run.frontend = "klt";
  run.version = "1.2.3";
  for (int k = 0; k < 200; ++k) {
    const double a = 0.05 * k;
    TrajectoryPoint truth;
    truth.t = Time{1'000'000'000'000 + k * 50'000'000LL};
    truth.T_WB = {so3_exp(Vec3(0, 0, a)), Vec3(2 * std::cos(a), 2 * std::sin(a), 1)};
    truth.v_WB = Vec3(-2 * std::sin(a), 2 * std::cos(a), 0);
    truth.bias = ImuBias{Vec3(0.01, 0.02, 0.03), Vec3(0.1, 0.2, 0.3)};
    run.truth.push_back(truth);
    Odometry o;
    o.t = truth.t;
    o.T_WB = w_from_truth * truth.T_WB;
    o.v_WB = w_from_truth.q * *truth.v_WB;
    o.bias = *truth.bias;
    if (k > 0) {  // the first pose defines W
      o.T_WB = o.T_WB.boxplus(noise(kSigma_m), noise(kSigma_rad));
      o.v_WB += noise(kSigma_mps);
      o.bias.gyro_radps += noise(kSigma_bg);
      o.bias.accel_mps2 += noise(kSigma_ba);
    }
    o.pose_covariance.diagonal() << Vec3::Constant(kSigma_m * kSigma_m), Vec3::Constant(kSigma_rad * kSigma_rad);
    o.velocity_covariance = kSigma_mps * kSigma_mps * Mat3::Identity();
    o.gyro_bias_covariance = kSigma_bg * kSigma_bg * Mat3::Identity();
    o.accel_bias_covariance = kSigma_ba * kSigma_ba * Mat3::Identity();
    o.health = {k == 150 ? HealthState::degraded : HealthState::good, k == 150 ? HealthReason::few_tracks : HealthReason::none};
    run.odometry.push_back(o);
  }
  return run;
}

}  // namespace fbvins
