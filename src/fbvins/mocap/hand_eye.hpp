// SPDX-License-Identifier: Apache-2.0
// Extrinsics of the markers on the IMU, pose of the motion capture's world against W, and its clock's offset and drift, from one
// flight's estimate and markers. Pure functions, any thread. Method: docs/derivations/hand_eye.md.
//
//   Result<HandEye> found = align_hand_eye(track, estimate, {});
//   Trajectory<W> truth = body_truth(found->kept, found->calibration);   // T_WB by the estimate's clock
#pragma once

#include <array>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/mocap/marker_faults.hpp"
#include "fbvins/mocap/serial_noise.hpp"
#include "fbvins/types/motion_capture.hpp"
#include "fbvins/types/trajectory.hpp"

namespace fbvins {

struct HandEyeOptions {
  bool level_world = false;  ///< V is as level as W is: only heading and translation are between them
  bool clock_drift = false;  ///< estimate the drift of the clocks, too
};

/// T_VK(s) = T_VW * T_WB(t) * T_BK with t = s + offset + drift * (s - reference).
struct MarkerCalibration {
  Pose<B, K> T_BK;
  Pose<V, W> T_VW;
  Time reference;  ///< of the motion capture's clock
  Duration offset;
  double drift = 0;  ///< seconds a second

  Time to_estimate(Time marker) const;
  Time to_marker(Time estimate) const;
};

/// Order of the unknowns: lever arm p_BK (m, in B), R_BK (rad, about axes of K), p_VW (m, in W), R_VW (rad, about axes of W),
/// offset (s), drift (s/s), and of the estimate's own errors: scale minus one, share of the heading's drift that bends the path.
inline constexpr int kHandEyeUnknowns = 16;
using HandEyeMatrix = Eigen::Matrix<double, kHandEyeUnknowns, kHandEyeUnknowns>;

struct HandEye {
  MarkerCalibration calibration;
  HandEyeMatrix covariance = HandEyeMatrix::Zero();  ///< zero where something was not estimated
  /// Of the estimate against the markers, along W's axes: horizontal, vertical (m), tilt, heading (rad).
  std::array<SerialNoise, 4> noise;
  double disagreement =
      1;             ///< variance between stretches of the flight over that which the noise explains; a factor of the covariance
  double scale = 1;  ///< metres of the estimate's path to one of the markers'
  double clock_correlation = 0;
  int pairs = 0, outliers = 0;      ///< poses of the estimate that entered; that did not fit
  std::vector<MarkerFault> faults;  ///< flips and swaps, by the motion capture's clock
  MarkerTrack kept;                 ///< the track without them
};

/// `track` without the faults that `inspect` finds. An error, one sentence, where the two do not describe one motion or the
/// motion does not determine an unknown.
Result<HandEye> align_hand_eye(const MarkerTrack& track, const Trajectory<W>& estimate, const HandEyeOptions& options);

/// The IMU's poses computed from the markers, in W, by the estimate's clock.
Trajectory<W> body_truth(const MarkerTrack& track, const MarkerCalibration& calibration);

}  // namespace fbvins
