// SPDX-License-Identifier: Apache-2.0
// Options of loop closure. What need not be set is a named constant beside the code that uses it.
#pragma once

#include "fbvins/core/angle.hpp"

namespace fbvins {

/// Features of a keyframe.
struct PlaceExtractorOptions {
  int max_features = 500;

  template <class V>
  void visit(V&& v) {
    v("max_features", max_features, "", "features of one image", 10, 10000);
  }
};

/// Whether two keyframes show the same place.
/// Whether two keyframes show the same place (L7); set by tests.
struct PlaceVerifierOptions {
  int min_inliers = 28;             ///< of an accepted pose
  double min_visible_share = 0.16;  ///< inliers out of the candidate's points that should be visible
  int max_distance_bit = 72;        ///< largest Hamming distance of a match
};

/// How fast the odometry may drift where its covariance is not known: standard deviations after a metre, which grow with the root
/// of the path. Set by tests.
struct DriftOptions {
  double position_m = 0.006;
  double yaw_rad = 0.06 * kDegree;
};

struct LoopOptions {
  PlaceExtractorOptions extraction;
  PlaceVerifierOptions verification;
  DriftOptions drift;
  double max_distance_m = 4;  ///< places farther than this from the predicted position are not tried; set by tests
  double gate_sigma = 5;      ///< a recognised place farther than this from the odometry's prediction is refused; set by tests
  int thin_above = 600;
  int max_keyframes = 3000;
  int memory_mb = 200;
  int degrees_of_freedom = 4;  ///< of a keyframe in the graph: 4, position and yaw; 6, roll and pitch as well

  template <class V>
  void visit(V&& v) {
    v("max_keyframes", max_keyframes, "", "keyframes of the map at most", 20, 1000000);
    v("memory_mb", memory_mb, "MB", "features of a loaded map in memory at most; others are read from its file when needed", 0,
      1000000);
    v("thin_above", thin_above, "", "keyframes above which redundant ones are removed", 10, 1000000);
    v.group("extraction", extraction, "features of a keyframe");
  }
};

}  // namespace fbvins
