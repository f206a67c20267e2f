// SPDX-License-Identifier: Apache-2.0
// Aligns the gyroscope's rotation with the camera's from frame to frame: the readings' unit, their axes, and the time offset,
// none of which is assumed beforehand. Pure functions, any thread.
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

/// Two left images a tenth of a second apart, and the motion between them, estimated from their features.
struct FramePair {
  Time a, b;
  std::size_t frame_a = 0, frame_b = 0;
  std::vector<PairedFeature> features;
  Vec3 turn = Vec3::Zero();        ///< rotation vector of R_CaCb, rad
  Vec3 p_CaCb = Vec3::Zero();      ///< m, with the depths of the working rig; of length 1 where nothing has depths
  bool without_depths = false;     ///< of one camera alone
  Mat6 covariance = Mat6::Zero();  ///< of (turn, p)
  double rms_px = 0;
  double dt_s() const { return (b - a).seconds(); }
};

/// Pairs that follow one another, where enough features were followed; those whose motion cannot be estimated are left out.
std::vector<FramePair> pair_frames(const Evidence& evidence);

struct TurnFit {
  bool seen = false;             ///< the rig rotated enough; only then the rest holds
  double turning_rad = 0;        ///< root mean square of a pair's rotation, by the camera
  double correlation = 0;        ///< 1: the readings, rotated and scaled, are what the camera saw
  double offset_s = 0;           ///< t_imu = t_image + offset
  double scale = 1;              ///< the camera's rotation over the readings'
  bool mirrored = false;         ///< a reflection explains much more than any rotation
  Mat3 R_CB = Mat3::Identity();  ///< that rotation, or reflection
  Vec3 spread = Vec3::Zero();    ///< rotation in a pair's time about the principal axes, descending: root mean squares, rad
};

TurnFit fit_turns(const std::vector<FramePair>& pairs, const ImuSeries& imu, const StereoRig& rig);

}  // namespace fbvins
