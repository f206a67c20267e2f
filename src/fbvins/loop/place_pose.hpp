// SPDX-License-Identifier: Apache-2.0
// Relative pose of two images, with its information, from matches of two places.
// RANSAC on three points, then maximum likelihood over all inliers, which takes the errors of both views into account
// (docs/derivations/loop.md, L3-L6). Pure functions; the Rng makes them repeatable.
//
//   Rng rng(1);
//   auto pose = ransac_pose(query, candidate, matches, rng);       // without a prior
//   RelativePose fine = refine_pose(query, candidate, matches, *pose);
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fbvins/core/angle.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/features/hamming.hpp"
#include "fbvins/loop/place.hpp"

namespace fbvins {

/// Takes points from the candidate's left camera to the query's.
using CameraFromCamera = Pose<C0, C0>;

/// Poses whose vertical differs more from the odometry's are refused.
inline constexpr double kMaxTilt_rad = 4 * kDegree;

/// a: index in the query; b: index in the candidate.
struct RelativePose {
  CameraFromCamera T_qc;
  Mat6 information = Mat6::Zero();  ///< of (dp in the query's C0, dtheta in the candidate's C0)
  std::vector<DescriptorMatch> inliers;
};

/// Angle between the vertical that T_qc carries over from the candidate and the query's own, rad.
double tilt_error_rad(const Place& query, const Place& candidate, const Mat3& R_qc);

std::optional<CameraFromCamera> ransac_pose(const Place& query, const Place& candidate, std::span<const DescriptorMatch> matches,
                                            Rng& rng);

/// Gauss-Newton with Huber weights from `start`; inliers empty when it does not converge.
RelativePose refine_pose(const Place& query, const Place& candidate, std::span<const DescriptorMatch> matches,
                         const CameraFromCamera& start);

}  // namespace fbvins
