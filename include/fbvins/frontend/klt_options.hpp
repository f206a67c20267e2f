// SPDX-License-Identifier: Apache-2.0
// Options of the klt frontend.
#pragma once

namespace fbvins {

struct KltFrontendOptions {
  int max_features = 150;
  double min_distance_px = 22;
  double epipolar_px = 0.7;
  double sigma_px = 0.6;
  double min_depth_m = 0.35;  ///< smallest depth that is searched for in the right image; set by tests
  double max_gap_s = 0.6;     ///< after a longer gap without left images all tracks are dropped; set by tests

  template <class V>
  void visit(V&& v) {
    v("max_features", max_features, "",
      "features followed at once by a pair of cameras; two pairs share a third more, three or more twice as many", 10, 2000);
    v("min_distance_px", min_distance_px, "px", "smallest distance between features; half the side of the cells that share them",
      4.0, 200.0);
    v("epipolar_px", epipolar_px, "px", "RANSAC threshold between consecutive left images", 0.1, 10.0);
    v("sigma_px", sigma_px, "px", "standard deviation of an observation, for the estimator", 0.05, 10.0);
  }
};

}  // namespace fbvins
