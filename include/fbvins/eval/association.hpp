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

struct PosePair {
  StampedPose truth;
  StampedPose estimate;
};

/// Pairs in order of time. Both trajectories may be unsorted; equal stamps keep their order.
std::vector<PosePair> associate(Trajectory truth, Trajectory estimate, const AssociationOptions& options);

}  // namespace fbvins
