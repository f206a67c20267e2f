// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/relative_error.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fbvins {
namespace {

/// Distance travelled, or time passed, from the first pair to each.
std::vector<double> progress(const std::vector<PosePair>& pairs, const RelativeErrorOptions& options) {
  std::vector<double> done(pairs.size(), 0.0);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    const auto of = [&](const PosePair& pair) { return options.path_of_truth ? pair.truth : pair.estimate; };
    const StampedPose<AnyWorld> a = of(pairs[i - 1]), b = of(pairs[i]);
    done[i] = options.unit == DeltaUnit::metres ? done[i - 1] + (b.T.p - a.T.p).norm() : (b.t - of(pairs[0]).t).seconds();
  }
  return done;
}

/// The first index after `from` whose progress is nearest to progress[from] + delta; progress never falls.
int nearest_ahead(const std::vector<double>& done, int from, double delta) {
  const auto begin = done.begin() + from + 1;
  const double wanted = done[static_cast<std::size_t>(from)] + delta;
  auto best = std::lower_bound(begin, done.end(), wanted);
  if (best == done.end() || (best != begin && wanted - *std::prev(best) <= *best - wanted))
    best = std::lower_bound(begin, done.end(), *std::prev(best));  // the first of equals: at rest there is no progress
  return static_cast<int>(best - done.begin());
}

}  // namespace

std::vector<std::pair<int, int>> delta_pairs(const std::vector<PosePair>& pairs, const RelativeErrorOptions& options) {
  const std::vector<double> done = progress(pairs, options);
  const int n = static_cast<int>(done.size());
  const auto between = [&](int i, int j) { return done[static_cast<std::size_t>(j)] - done[static_cast<std::size_t>(i)]; };
  std::vector<std::pair<int, int>> result;
  // Stamps are integers of ns and sums of lengths round: a nanosecond, or a nanometre, is not a difference.
  const double slack = 1e-9;
  if (!options.all_pairs) {
    int from = 0;
    for (int to = 1; to < n; ++to)
      if (between(from, to) >= options.delta - slack) {
        result.emplace_back(from, to);
        from = to;
      }
    return result;
  }
  for (int from = 0; from + 1 < n; ++from) {
    const int to = nearest_ahead(done, from, options.delta);
    if (std::abs(between(from, to) - options.delta) <= options.tolerance * options.delta + slack) result.emplace_back(from, to);
  }
  return result;
}

RelativeErrors relative_errors(const std::vector<PosePair>& pairs, const RelativeErrorOptions& options) {
  RelativeErrors errors;
  for (const auto& [i, j] : delta_pairs(pairs, options)) {
    const PosePair& from = pairs[static_cast<std::size_t>(i)];
    const PosePair& to = pairs[static_cast<std::size_t>(j)];
    const auto truth = from.truth.T.inverse() * to.truth.T;
    const auto estimate = from.estimate.T.inverse() * to.estimate.T;
    const auto error = truth.inverse() * estimate;
    errors.translation_m.push_back(error.p.norm());
    errors.rotation_deg.push_back(so3_log(error.q).norm() * 180.0 / std::numbers::pi);
  }
  return errors;
}

}  // namespace fbvins
