// SPDX-License-Identifier: Apache-2.0
// How the camera turned from frame to frame, and what has to be done to the gyroscope's readings to say the same: their unit,
// their axes, the time between the clocks. None of these is assumed beforehand. Pure functions, any thread.
//
//   std::vector<FramePair> pairs = pair_frames(evidence);
//   TurnFit fit = fit_turns(pairs, imu, rig);
//   if (fit.seen) use(fit.offset_s, fit.scale, fit.R_CB);
#pragma once

#include <vector>

#include "fbvins/doctor/evidence.hpp"
#include "fbvins/doctor/imu_series.hpp"

namespace fbvins {

/// A feature in two left images.
struct PairedFeature {
  Vec2 a_px = Vec2::Zero(), b_px = Vec2::Zero();
  double inverse_depth = 0;  ///< 1/m, in the first
};

/// Two left images a tenth of a second apart, and the motion between them that their features tell.
struct FramePair {
  Time a, b;
  std::size_t frame_a = 0, frame_b = 0;
  std::vector<PairedFeature> features;
  Vec3 turn = Vec3::Zero();        ///< rotation vector of R_CaCb, rad
  Vec3 p_CaCb = Vec3::Zero();      ///< m, by the working rig
  Mat6 covariance = Mat6::Zero();  ///< of (turn, p)
  double rms_px = 0;
  double dt_s() const { return (b - a).seconds(); }
};

/// Pairs that follow one another, where enough features were followed; those whose motion cannot be told are left out.
std::vector<FramePair> pair_frames(const Evidence& evidence);

struct TurnFit {
  bool seen = false;             ///< the rig turned enough, and both saw it
  double turning_rad = 0;        ///< root mean square of a pair's turn, by the camera
  double correlation = 0;        ///< 1: the readings, turned and scaled, are what the camera saw
  double offset_s = 0;           ///< t_imu = t_image + offset
  double scale = 1;              ///< the camera's turn over the readings'
  bool mirrored = false;         ///< no rotation makes the readings what was seen, a reflection does
  Mat3 R_CB = Mat3::Identity();  ///< that rotation, or reflection
  Vec3 spread = Vec3::Zero();    ///< turning about the three main axes, descending: root mean squares, rad
};

TurnFit fit_turns(const std::vector<FramePair>& pairs, const ImuSeries& imu, const StereoRig& rig);

}  // namespace fbvins
