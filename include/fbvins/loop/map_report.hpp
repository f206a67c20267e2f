// SPDX-License-Identifier: Apache-2.0
// Reports of the two optimisations that finish a map. Values.
#pragma once

#include <string>

namespace fbvins {

/// Of an optimisation over the graph of keyframes.
struct PoseGraphReport {
  int solves = 0;
  int iterations = 0;
  int rejected = 0;          ///< loops with a weight below a tenth
  int anchors = 0;           ///< that count
  int anchors_rejected = 0;  ///< with a weight below a tenth
  double initial_cost = 0, final_cost = 0;
};

/// How well poses fit measurements that they were not, or not only, fitted to: mean squared residuals in standard deviations, 1
/// where the noise is as assumed, and smaller is better.
struct Plausibility {
  double held_out = 0;  ///< observations of points held out of the adjustment, robust
  double imu = 0;       ///< the readings, with the motions, biases and gravity that suit the poses best; 0 without readings
  double anchors = 0;   ///< of an anchored map: its anchors, without outliers
  double odometry = 0;  ///< the steps between keyframes against the odometry and its drift
};

/// Of the bundle adjustment over all keyframes and points.
struct FinalAdjustmentReport {
  int keyframes = 0, points = 0, observations = 0, iterations = 0;
  double initial_rms_px = 0, final_rms_px = 0;  ///< of position in the image, both over the observations kept in the end
  Plausibility before, after;
  double tilt_rad = 0;       ///< by which the map was levelled
  std::string refused = {};  ///< why the result does not fit better than the start, and the map is as it was; empty: accepted
};

}  // namespace fbvins
