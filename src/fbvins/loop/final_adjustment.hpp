// SPDX-License-Identifier: Apache-2.0
// The best map there is time for once the flight is over: all keyframes and all points that two of them have seen,
// moved together until every sight fits (docs/derivations/loop.md, L16). Offline; one thread; the same map in gives
// the same map out.
//
//   FinalAdjustmentReport report = adjust_map(map, options.verification, options.graph, {});
#pragma once

#include "fbvins/loop/place_map.hpp"
#include "fbvins/loop/place_verifier.hpp"

namespace fbvins {

struct FinalAdjustmentOptions {
  int max_iterations = 25;
  int neighbours = 3;
  double radius_px = 8;
  double robust_sigma = 2;

  template <class V>
  void visit(V&& v) {
    v("max_iterations", max_iterations, "", "Levenberg-Marquardt iterations of each of the two solves", 1, 1000);
    v("neighbours", neighbours, "", "keyframes before it that each keyframe is matched with", 1, 100);
    v("radius_px", radius_px, "px", "how far from where the map predicts it a match may be", 1.0, 100.0);
    v("robust_sigma", robust_sigma, "", "residual from which a sight counts less (Cauchy)", 0.1, 100.0);
  }
};

struct FinalAdjustmentReport {
  int keyframes = 0, points = 0, sights = 0, iterations = 0;
  double initial_rms_px = 0, final_rms_px = 0;  ///< of position in the image, both over the sights kept in the end
};

/// Moves the placed keyframes; the first one stays. A map without two views of one point stays as it is.
FinalAdjustmentReport adjust_map(PlaceMap& map, const PlaceVerifierOptions& matching, const PoseGraphOptions& graph,
                                 const FinalAdjustmentOptions& options);

}  // namespace fbvins
