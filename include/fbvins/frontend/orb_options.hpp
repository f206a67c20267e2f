// SPDX-License-Identifier: Apache-2.0
// Options of the orb and boost frontends.
#pragma once

namespace fbvins {

/// Landmarks re-observed after they were out of view.
struct RecognitionOptions {
  bool enabled = true;
  int capacity = 3000;  ///< landmarks remembered; set by tests

  template <class V>
  void visit(V&& v) {
    v("enabled", enabled, "", "re-observe landmarks, however long they were out of view");
  }
};

struct OrbFrontendOptions {
  int max_features = 180;
  int max_keypoints = 400;
  double min_distance_px = 14;
  double memory_s = 1.0;  ///< how long a feature that is not observed is searched for at its predicted position; set by tests
  double search_px = 12;  ///< radius around a prediction from the estimator's state; set by tests
  double epipolar_px = 1.0;
  double sigma_px = 0.6;
  double min_depth_m = 0.35;        ///< smallest depth that is searched for in the right image; set by tests
  double stereo_epipolar_px = 1.5;  ///< largest distance of a match from the right epipolar line; set by tests
  RecognitionOptions recognition = {};

  template <class V>
  void visit(V&& v) {
    v("max_features", max_features, "",
      "features followed at once by a pair of cameras; two pairs share a third more, three or more twice as many", 10, 2000);
    v("max_keypoints", max_keypoints, "", "keypoints extracted from one image, as candidates for tracks", 10, 10000);
    v("min_distance_px", min_distance_px, "px", "smallest distance of a new feature from others", 2.0, 200.0);
    v("epipolar_px", epipolar_px, "px", "RANSAC threshold between left images", 0.1, 10.0);
    v("sigma_px", sigma_px, "px", "standard deviation of an observation, for the estimator", 0.05, 10.0);
    v.group("recognition", recognition, "landmarks re-observed after they were out of view");
  }
};

}  // namespace fbvins
