// SPDX-License-Identifier: Apache-2.0
// Relative pose error (J. Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems",
// IROS 2012): how far the estimate's motion over one metre or one second differs from the truth's.
// Pure functions, any thread.
//
//   RelativeErrors per_metre = relative_errors(pairs, {.unit = DeltaUnit::metres, .delta = 1});
//   ErrorStatistics drift_m = statistics_of(per_metre.translation_m);
#pragma once

#include <utility>
#include <vector>

#include "fbvins/eval/association.hpp"

namespace fbvins {

enum class DeltaUnit { metres, seconds };

struct RelativeErrorOptions {
  DeltaUnit unit = DeltaUnit::metres;
  double delta = 1.0;  ///< m of path or s
  /// true (default): from every pose to the pose whose distance is nearest to delta, if within
  /// `tolerance`. false: pieces that do not overlap, each ended by the first pose at least delta away.
  bool all_pairs = true;
  double tolerance = 0.1;  ///< relative to delta; all_pairs only
  /// Path lengths are measured along the truth (default), so that the pieces do not depend on the
  /// estimate; along the estimate is what evo does unless told --pairs_from_reference.
  bool path_of_truth = true;
};

struct RelativeErrors {
  std::vector<double> translation_m;
  std::vector<double> rotation_deg;
};

/// Indices (from, to) of the pieces.
std::vector<std::pair<int, int>> delta_pairs(const std::vector<PosePair>& pairs, const RelativeErrorOptions& options);

/// E = (T_truth_i^-1 T_truth_j)^-1 (T_estimate_i^-1 T_estimate_j) over all pieces.
RelativeErrors relative_errors(const std::vector<PosePair>& pairs, const RelativeErrorOptions& options);

}  // namespace fbvins
