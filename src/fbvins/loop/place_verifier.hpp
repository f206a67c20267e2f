// SPDX-License-Identifier: Apache-2.0
// Is this the same place, and where was it seen from? Descriptors propose matches, RANSAC or a prediction proposes a
// pose, a guided second matching collects what that pose explains, and the refined pose is accepted only if enough
// of what should be visible was found, spread over the image (docs/derivations/loop.md, L3-L7).
// Knows nothing of the flight: whether the odometry allows the pose is the loop closer's question.
// Buffers are reused; one instance, one thread.
//
//   PlaceVerifier verifier({});
//   verifier.set_query(place);
//   if (auto found = verifier.verify(candidate)) use(found->T_qc);
#pragma once

#include <optional>
#include <vector>

#include "fbvins/loop/place_pose.hpp"

namespace fbvins {

struct PlaceVerifierOptions {
  PlacePoseOptions pose;
  HammingOptions matching{.max_distance = 72, .max_ratio = 0.9, .mutual = true};
  int min_matches = 12;
  double guided_px = 8;
  int guided_distance = 72;
  int min_inliers = 28;
  double min_visible_share = 0.16;
  int min_cells = 5;
  double mutual_share = 0.5;
  double mutual_m = 0.1;
  double mutual_rad = 0.03;
  int seed = 1;

  template <class V>
  void visit(V&& v) {
    v.group("pose", pose, "relative pose from matches");
    v.group("matching", matching, "first matching, by descriptors alone");
    v("min_matches", min_matches, "", "first matches below which RANSAC is not tried", 4, 1000);
    v("guided_px", guided_px, "px", "radius of the guided second matching, times the scale of the keypoint", 0.5, 100.0);
    v("guided_distance", guided_distance, "bit", "largest Hamming distance of the guided matching", 1, 256);
    v("min_inliers", min_inliers, "", "inliers of an accepted pose", 4, 1000);
    v("min_visible_share", min_visible_share, "", "inliers out of the candidate's points that should be visible", 0.0, 1.0);
    v("min_cells", min_cells, "", "cells of a 4x4 grid over the image that hold inliers", 1, 16);
    v("mutual_share", mutual_share, "", "inliers that the other direction must find, out of those needed", 0.0, 1.0);
    v("mutual_m", mutual_m, "m", "largest difference of the poses found from both directions", 0.0, 10.0);
    v("mutual_rad", mutual_rad, "rad", "largest difference of the rotations found from both directions", 0.0, 3.0);
    v("seed", seed, "", "of RANSAC", 0, 1000000);
  }
};

/// Boosted descriptors of one point lie nearer to one another than raw ones: no match is farther than suits them.
PlaceVerifierOptions for_boosted(PlaceVerifierOptions options);

/// A guess of the pose, and how far a feature may be from where it predicts it.
struct PosePrediction {
  CameraFromCamera T_qc;
  double radius_px = 20;
};

struct VerifiedPose {
  RelativePose pose;
  int visible = 0;  ///< candidate's points inside the query's view
  int cells = 0;    ///< of a 4x4 grid over the query's view that hold inliers
  double tilt_error_rad = 0;
};

class PlaceVerifier {
 public:
  explicit PlaceVerifier(const PlaceVerifierOptions& options) : options_(options) {}

  /// Keeps a reference to `query` until the next call.
  void set_query(const Place& query);
  /// From nothing (descriptor matches and RANSAC), once each way: repeated patterns (tiles, curtains) give confident
  /// poses that differ between the two ways.
  std::optional<VerifiedPose> verify(const Place& candidate);
  /// Near a predicted pose.
  std::optional<VerifiedPose> verify(const Place& candidate, const PosePrediction& prediction);
  /// What the last verify() found, accepted or not.
  const VerifiedPose& last() const { return last_; }

 private:
  std::optional<VerifiedPose> one_way(const Place& candidate);
  bool confirmed_by_other_way(const Place& candidate, const CameraFromCamera& T_qc);
  std::optional<VerifiedPose> collect(const Place& candidate, CameraFromCamera start, double radius_px, int rounds);
  void match_guided(const Place& candidate, const CameraFromCamera& T_qc, double radius_px);
  void judge(const Place& candidate, RelativePose pose);
  bool accepted() const;
  int cell_of(double x, double y) const;

  PlaceVerifierOptions options_;
  const Place* query_ = nullptr;
  // The query's features by cell of a grid over its view (normalised coordinates).
  static constexpr int kColumns = 24, kRows = 16;
  Vec2 low_ = Vec2::Zero(), high_ = Vec2::Zero();
  std::vector<std::int32_t> cell_begin_, by_cell_;
  std::vector<DescriptorMatch> guided_, best_of_query_;
  VerifiedPose last_;
  int visible_ = 0;
};

}  // namespace fbvins
