// SPDX-License-Identifier: Apache-2.0
// Is this the same place, and where was it seen from? Descriptors propose matches, RANSAC or a prediction proposes a
// pose, a guided second matching collects what that pose explains, and the refined pose is accepted only if enough
// of what should be visible was found, spread over the image (docs/derivations/loop.md, L3-L7).
// Knows nothing of the flight: the loop closer checks the pose against the odometry.
// Buffers are reused; one instance, one thread.
//
//   PlaceVerifier verifier({});
//   verifier.set_query(place);
//   if (auto found = verifier.verify(candidate)) use(found->T_qc);
#pragma once

#include <optional>
#include <vector>

#include "fbvins/loop/loop_options.hpp"
#include "fbvins/loop/place_pose.hpp"

namespace fbvins {

/// Boosted descriptors of one point lie nearer to one another than raw ones: the largest distance of a match is smaller.
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
  /// Without a prior (descriptor matches and RANSAC), in both directions: repeated patterns (tiles, curtains) give poses
  /// with many inliers that differ between the two.
  std::optional<VerifiedPose> verify(const Place& candidate);
  /// Near a predicted pose.
  std::optional<VerifiedPose> verify(const Place& candidate, const PosePrediction& prediction);
  /// What the last verify() found, accepted or not.
  const VerifiedPose& last() const { return last_; }

 private:
  std::optional<VerifiedPose> one_way(const Place& candidate);
  bool confirmed_by_other_way(const Place& candidate, const CameraFromCamera& T_qc);
  std::optional<VerifiedPose> collect(const Place& candidate, CameraFromCamera start, double radius_px);
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
