// SPDX-License-Identifier: Apache-2.0
// Which pose of the ground truth belongs to which pose of the estimate.
// Pure functions, any thread.
//
//   std::vector<PosePair> pairs = associate(truth, estimate, {});
#pragma once

#include <vector>

#include "fbvins/types/trajectory.hpp"

namespace fbvins {

enum class AssociationMethod {
  /// evo's rule: for every pose of the trajectory with fewer poses (the estimate when equal) the
  /// nearest stamp of the other, the earlier one of two equally near.
  nearest,
  /// For every pose of the estimate the truth at that very stamp: position linear, rotation SLERP.
  interpolate_truth,
};

struct AssociationOptions {
  AssociationMethod method = AssociationMethod::nearest;
  double max_difference_s = 0.01;     ///< of the two stamps; nearest only
  double max_interpolation_s = 0.25;  ///< longest hole of the truth that is bridged; interpolation only
};

/// The world of a trajectory, whichever it is: errors are the same in all of them.
struct AnyWorld {};

/// A trajectory in any frame, so that evaluation is compiled once and takes them all.
struct AnyTrajectory {
  AnyTrajectory() = default;
  template <class Frame>
  AnyTrajectory(const Trajectory<Frame>& trajectory) {  // implicit: a call reads evaluate(truth, estimate)
    poses.reserve(trajectory.size());
    for (const StampedPose<Frame>& pose : trajectory) poses.push_back({pose.t, {pose.T.q, pose.T.p}});
  }

  Trajectory<AnyWorld> poses;
};

/// Each in a world of its own, until `apply` (alignment.hpp) aligns the estimate with the truth.
struct PosePair {
  StampedPose<AnyWorld> truth;
  StampedPose<AnyWorld> estimate;
};

/// Pairs in order of time. Both trajectories may be unsorted; equal stamps keep their order.
std::vector<PosePair> associate(AnyTrajectory truth, AnyTrajectory estimate, const AssociationOptions& options);

}  // namespace fbvins
