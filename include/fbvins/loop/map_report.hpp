// SPDX-License-Identifier: Apache-2.0
// What the two ways of ending a map say of themselves. Values.
#pragma once

namespace fbvins {

/// Of an optimisation over the graph of keyframes.
struct PoseGraphReport {
  int solves = 0;
  int iterations = 0;
  int rejected = 0;  ///< loops with a weight below a tenth
  double initial_cost = 0, final_cost = 0;
};

/// Of the bundle adjustment over all keyframes and points.
struct FinalAdjustmentReport {
  int keyframes = 0, points = 0, sights = 0, iterations = 0;
  double initial_rms_px = 0, final_rms_px = 0;  ///< of position in the image, both over the sights kept in the end
};

}  // namespace fbvins
