// SPDX-License-Identifier: Apache-2.0
// Compares the accelerometer with the accelerations that the cameras saw: its axes, and the length of the baseline for which
// the two agree. Velocity and gravity are estimated in each window of some seconds, so that neither attitude nor gravity's unit
// matters; the accelerometer's bias is one for the whole recording.
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
  bool seen = false;                  ///< the rig accelerated enough, and the readings explain it
  double scale = 1, scale_sigma = 0;  ///< seen over measured acceleration, with the axes below
  Mat3 axes = Mat3::Identity();       ///< signed permutation, f_B = axes * reading; not the identity where it fits clearly better
  double unexplained = 0;             ///< share of the seen acceleration (mean square) that the readings do not explain
  double unexplained_as_named = 0;    ///< the same with the axes as delivered
  double gravity_mps2 = 0, gravity_sigma_mps2 = 0;  ///< in metres of the cameras: that of a baseline which is too long is larger
  Vec3 bias = Vec3::Zero(), bias_sigma = Vec3::Zero();        ///< of the readings with these axes, in their unit
  Vec3 lever_m = Vec3::Zero(), lever_sigma_m = Vec3::Zero();  ///< to be added to p_BC0, where that is wrong
  double unexplained_elsewhere = 0;                           ///< what is unexplained with the camera there
  double acceleration_mps2 = 0;                               ///< seen, root mean square, without each window's mean
};

/// `rig`: T_BC0 as corrected.
AccelFit fit_accelerations(const std::vector<FramePair>& pairs, const ImuSeries& imu, const StereoRig& rig,
                           const AccelStart& start);

/// How many standard deviations the bias is from none. By the axes' own ones where gravity confirms it: as read it is off by
/// `gravity_off_mps2`, without the bias by much less. Else all axes count as the least certain one.
double bias_significance(const AccelFit& fit, double gravity_off_mps2, double off_without_bias_mps2);

}  // namespace fbvins
