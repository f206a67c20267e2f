// SPDX-License-Identifier: Apache-2.0
// Where one image was taken as seen from another: matches of two places -> relative pose with information.
// RANSAC on three points, then maximum likelihood over all inliers, in which the errors of both views count
// (docs/derivations/loop.md, L3-L6). Pure functions; the Rng makes them repeatable.
//
//   Rng rng(1);
//   auto pose = ransac_pose(query, candidate, matches, options, rng);       // no idea where
//   RelativePose fine = refine_pose(query, candidate, matches, *pose, options);
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/features/hamming.hpp"
#include "fbvins/loop/place.hpp"

namespace fbvins {

/// Takes points from the candidate's left camera to the query's.
using CameraFromCamera = Pose<C0, C0>;

struct PlacePoseOptions {
  int max_iterations = 100;
  double inlier_px = 3.0;
  double max_tilt_deg = 4.0;
  double outlier_sigma = 3.4;

  template <class V>
  void visit(V&& v) {
    v("max_iterations", max_iterations, "", "samples of three points tried at most", 1, 10000);
    v("inlier_px", inlier_px, "px", "largest reprojection error of an inlier of a sample, times its scale", 0.1, 50.0);
    v("max_tilt_deg", max_tilt_deg, "deg", "poses whose vertical differs more from the odometry's are refused", 0.1, 180.0);
    v("outlier_sigma", outlier_sigma, "", "a match farther from the refined pose than this is an outlier", 1.0, 20.0);
  }
};

/// a: index in the query; b: index in the candidate.
struct RelativePose {
  CameraFromCamera T_qc;
  Mat6 information = Mat6::Zero();  ///< of (dp in the query's C0, dtheta in the candidate's C0)
  std::vector<DescriptorMatch> inliers;
  int with_depth_both = 0;  ///< inliers with depth in both views
};

/// Angle between the vertical that T_qc carries over from the candidate and the query's own, rad.
double tilt_error_rad(const Place& query, const Place& candidate, const Mat3& R_qc);

std::optional<CameraFromCamera> ransac_pose(const Place& query, const Place& candidate, std::span<const DescriptorMatch> matches,
                                            const PlacePoseOptions& options, Rng& rng);

/// Gauss-Newton with Huber weights from `start`; inliers empty when it does not converge.
RelativePose refine_pose(const Place& query, const Place& candidate, std::span<const DescriptorMatch> matches,
                         const CameraFromCamera& start, const PlacePoseOptions& options);

}  // namespace fbvins
