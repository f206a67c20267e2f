// SPDX-License-Identifier: Apache-2.0
// The accelerometer against what the cameras saw of the rig's accelerations: its axes, and how long the baseline must be for the
// two to agree. In windows of some seconds velocity and gravity are free, so that neither level nor units of gravity enter;
// the accelerometer's bias is free for the whole recording.
// Pure functions, any thread.
//
//   AccelFit fit = fit_accelerations(pairs, imu, rig, {offset_s, gyro_bias});
//   if (fit.seen) use(fit.scale, fit.axes);
#pragma once

#include <vector>

#include "fbvins/doctor/turn_fit.hpp"

namespace fbvins {

struct AccelStart {
  double offset_s = 0;
  Vec3 gyro_bias_radps = Vec3::Zero();
};

struct AccelFit {
  bool seen = false;                  ///< the rig accelerated enough
  double scale = 1, scale_sigma = 0;  ///< seen acceleration over read one, along the axes below
  Mat3 axes = Mat3::Identity();       ///< of the 48 ways to name and sign three axes the one that fits: f_B = axes * reading
  double unexplained = 0;             ///< share of the seen acceleration (mean square) that the readings do not explain
  double unexplained_as_named = 0;    ///< the same with the axes as they are named
  double acceleration_mps2 = 0;       ///< seen, root mean square without its mean over a window
};

/// `rig`: T_BC0 as corrected.
AccelFit fit_accelerations(const std::vector<FramePair>& pairs, const ImuSeries& imu, const StereoRig& rig,
                           const AccelStart& start);

}  // namespace fbvins
