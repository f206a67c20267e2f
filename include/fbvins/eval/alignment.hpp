// SPDX-License-Identifier: Apache-2.0
// The transformation that lays an estimate over the ground truth (S. Umeyama, "Least-squares
// estimation of transformation parameters between two point patterns", PAMI 1991).
// Pure functions, any thread.
//
//   Result<Similarity> S = align(pairs, Alignment::se3);
//   if (S) std::vector<PosePair> laid = apply(*S, pairs);
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/eval/association.hpp"

namespace fbvins {

enum class Alignment {
  none,
  yaw,   ///< 4 degrees of freedom: shift and rotation about z, the direction of gravity is kept
  se3,   ///< 6 degrees of freedom, the usual choice
  sim3,  ///< 7 degrees of freedom, with scale
};

std::string_view to_string(Alignment alignment);
std::optional<Alignment> alignment_from_string(std::string_view name);

/// Takes the estimate's world to the truth's: p_truth = scale * (q * p_estimate) + p.
struct Similarity {
  double scale = 1;
  Quat q = Quat::Identity();
  Vec3 p = Vec3::Zero();

  /// The pose in the truth's world. The frame's type stays: after alignment the two are one frame.
  template <class Frame>
  Pose<Frame, B> operator*(const Pose<Frame, B>& T) const {
    return {(q * T.q).normalized(), Vec3(scale * (q * T.p) + p)};
  }
};

/// Least squares over the positions. An error where the positions do not determine it: fewer than
/// three pairs, or (se3, sim3) no two directions of motion.
Result<Similarity> align(const std::vector<PosePair>& pairs, Alignment alignment);

/// Translation and heading from the poses of the first second, the reference of a covariance that grows from the start. An
/// error without any pair.
Result<Similarity> align_start(const std::vector<PosePair>& pairs);

/// align_start for a truth whose world need not be level: motion capture and rendered flights have a constant tilt against
/// their own IMU, of up to half a degree, that no estimator can observe.
struct LevelledStart {
  Similarity to_truth;
  double truth_tilt_rad = 0;  ///< angle between the truth's z and the estimate's vertical in the flight's second half
};
Result<LevelledStart> align_start_levelled(const std::vector<PosePair>& pairs);

/// The same pairs with the estimate moved.
std::vector<PosePair> apply(const Similarity& similarity, std::vector<PosePair> pairs);

}  // namespace fbvins
