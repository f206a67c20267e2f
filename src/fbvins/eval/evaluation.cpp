// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/evaluation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

namespace fbvins {

std::vector<double> absolute_errors_m(const std::vector<PosePair>& pairs) {
  std::vector<double> errors;
  errors.reserve(pairs.size());
  for (const PosePair& pair : pairs) errors.push_back((pair.estimate.T.p - pair.truth.T.p).norm());
  return errors;
}

std::vector<double> absolute_errors_deg(const std::vector<PosePair>& pairs) {
  std::vector<double> errors;
  errors.reserve(pairs.size());
  for (const PosePair& pair : pairs) {
    const Quat error = pair.truth.T.q.conjugate() * pair.estimate.T.q;
    errors.push_back(so3_log(error).norm() * 180.0 / std::numbers::pi);
  }
  return errors;
}

Result<Evaluation> evaluate(const AnyTrajectory& truth, const AnyTrajectory& estimate, const EvaluationOptions& options) {
  std::vector<PosePair> pairs = associate(truth, estimate, options.association);
  if (pairs.empty())
    return Error{ErrorCode::invalid_argument,
                 fmt::format("none of the {} estimated poses belongs to one of the {} true poses: do the stamps use "
                             "the same clock?",
                             estimate.poses.size(), truth.poses.size())};
  const Result<Similarity> alignment = align(pairs, options.alignment);
  if (!alignment) return alignment.error();

  Evaluation e;
  e.pairs = static_cast<int>(pairs.size());
  e.alignment = *alignment;
  pairs = apply(*alignment, std::move(pairs));
  e.absolute_m = statistics_of(absolute_errors_m(pairs));
  e.absolute_rotation_deg = statistics_of(absolute_errors_deg(pairs));
  RelativeErrors metre = relative_errors(pairs, options.per_metre);
  e.per_metre_m = statistics_of(std::move(metre.translation_m));
  e.per_metre_deg = statistics_of(std::move(metre.rotation_deg));
  RelativeErrors second = relative_errors(pairs, options.per_second);
  e.per_second_m = statistics_of(std::move(second.translation_m));
  e.per_second_deg = statistics_of(std::move(second.rotation_deg));
  for (std::size_t i = 1; i < pairs.size(); ++i) e.truth_path_m += (pairs[i].truth.T.p - pairs[i - 1].truth.T.p).norm();
  for (const PosePair& pair : pairs)
    e.largest_excursion_m = std::max(e.largest_excursion_m, (pair.estimate.T.p - pairs.front().estimate.T.p).norm());
  return e;
}

}  // namespace fbvins
