// SPDX-License-Identifier: Apache-2.0
// How good a trajectory is, in one call: associate, align, absolute and relative errors.
// Pure functions, any thread.
//
//   Result<Evaluation> e = evaluate(truth, estimate, {});
//   if (e) fmt::print("ATE RMSE {} m\n", e->absolute_m.rmse);
#pragma once

#include <optional>

#include "fbvins/eval/alignment.hpp"
#include "fbvins/eval/relative_error.hpp"
#include "fbvins/eval/statistics.hpp"

namespace fbvins {

struct EvaluationOptions {
  AssociationOptions association;
  Alignment alignment = Alignment::se3;
  RelativeErrorOptions per_metre{.unit = DeltaUnit::metres};
  RelativeErrorOptions per_second{.unit = DeltaUnit::seconds};
  bool orientations = true;  ///< false: there are none, so that only absolute errors of positions are formed
};

struct Evaluation {
  int pairs = 0;
  double truth_path_m = 0;  ///< length of the truth between the pairs
  Similarity alignment;
  bool orientations = true;  ///< as in the options: without, the errors but the next are empty
  ErrorStatistics absolute_m;
  ErrorStatistics absolute_rotation_deg;
  ErrorStatistics per_metre_m, per_metre_deg;
  ErrorStatistics per_second_m, per_second_deg;
  double largest_excursion_m = 0;  ///< of the estimate from its first pose: drift where the truth is at rest
  double truth_share = 1;          ///< of the time between the estimate's first and last pose: where there is truth
  double longest_truth_gap_s = 0;  ///< of that time, at its ends too; absolute errors say nothing of it
  /// Where the truth has a gap: how far the estimate is from it at the end, aligned before the gap alone (poses, no scale).
  std::optional<double> end_drift_m;
};

/// Trajectories of any frames. Relative errors are not formed across a gap of the truth. An error when no poses can be associated
/// or they do not determine the alignment.
Result<Evaluation> evaluate(const AnyTrajectory& truth, const AnyTrajectory& estimate, const EvaluationOptions& options);

/// Whether they are given: not where all of a trajectory that moves are that of no rotation, as of positions alone.
bool has_orientations(const AnyTrajectory& trajectory);

/// |p_estimate - p_truth| of each pair, m.
std::vector<double> absolute_errors_m(const std::vector<PosePair>& pairs);
/// Angle between the two orientations of each pair, degrees.
std::vector<double> absolute_errors_deg(const std::vector<PosePair>& pairs);

}  // namespace fbvins
