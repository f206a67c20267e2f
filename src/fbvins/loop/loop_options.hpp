// SPDX-License-Identifier: Apache-2.0
// Options of loop closure.
#pragma once

#include "fbvins/loop/final_adjustment.hpp"
#include "fbvins/loop/map_frame.hpp"
#include "fbvins/loop/place_extractor.hpp"
#include "fbvins/loop/place_verifier.hpp"
#include "fbvins/loop/pose_graph.hpp"

namespace fbvins {

struct LoopOptions {
  PlaceExtractorOptions extraction;
  PlaceVerifierOptions verification;
  PoseGraphOptions graph;
  DriftOptions drift;
  FinalAdjustmentOptions final_ba;
  double min_age_s = 2;
  double max_distance_m = 4;
  double max_angle_deg = 65;
  int candidates = 3;
  double group_s = 3;
  double gate_sigma = 5;
  double loop_floor_m = 0.006;
  double loop_floor_deg = 0.10;
  double agree_m = 0.15;
  double agree_deg = 2.5;
  int sure_inliers = 90;
  double follow_mps = 0.15;
  double follow_degps = 3;
  int optimise_after = 24;
  int thin_above = 600;
  int max_keyframes = 3000;
  double redundant_m = 0.20;
  double redundant_deg = 12;

  template <class V>
  void visit(V&& v) {
    v.group("extraction", extraction, "features of a keyframe");
    v.group("verification", verification, "is it the same place");
    v.group("graph", graph, "pose graph");
    v.group("drift", drift, "how fast odometry drifts");
    v.group("final_ba", final_ba, "bundle adjustment over the whole map, after the run");
    v("min_age_s", min_age_s, "s", "keyframes younger than this are the odometry's business", 0.0, 1000.0);
    v("max_distance_m", max_distance_m, "m", "places farther than this from where we should be are not looked at", 0.1, 1000.0);
    v("max_angle_deg", max_angle_deg, "deg", "nor those seen from a direction that differs more", 1.0, 180.0);
    v("candidates", candidates, "", "places looked at closely for a keyframe", 1, 20);
    v("group_s", group_s, "s", "candidates this near in time are one place", 0.0, 100.0);
    v("gate_sigma", gate_sigma, "", "a recognised place farther from the odometry's own idea than this is refused", 1.0, 100.0);
    v("loop_floor_m", loop_floor_m, "m", "no loop is more certain than this", 1e-4, 1.0);
    v("loop_floor_deg", loop_floor_deg, "deg", "no loop is more certain than this", 1e-3, 10.0);
    v("agree_m", agree_m, "m", "relocalisation: two keyframes must agree to this", 0.01, 10.0);
    v("agree_deg", agree_deg, "deg", "relocalisation: two keyframes must agree to this", 0.1, 45.0);
    v("sure_inliers", sure_inliers, "", "relocalisation: so many inliers need no second keyframe", 10, 10000);
    v("follow_mps", follow_mps, "m/s", "fastest motion of the smooth T_MW", 0.001, 100.0);
    v("follow_degps", follow_degps, "deg/s", "fastest turn of the smooth T_MW", 0.01, 1000.0);
    v("optimise_after", optimise_after, "", "loops until the graph is optimised; a large map waits for a quarter of its size", 1,
      100000);
    v("thin_above", thin_above, "", "keyframes above which redundant ones are taken out", 10, 1000000);
    v("max_keyframes", max_keyframes, "", "keyframes of the map at most", 20, 1000000);
    v("redundant_m", redundant_m, "m", "a place recognised from so near adds nothing", 0.0, 10.0);
    v("redundant_deg", redundant_deg, "deg", "a place recognised from so near a direction adds nothing", 0.0, 90.0);
  }
};

}  // namespace fbvins
