// SPDX-License-Identifier: Apache-2.0
// Private to the doctor: which single change of a calibration explains an error best, then which one in addition. A change is a
// group of unknowns that are estimated together. A Fit is a value with
//   VectorXd x; std::vector<int> free;                  the current estimate, and which unknowns are estimated
//   std::optional<BlockSolution> converge();            Gauss-Newton from x; none where it cannot be solved
//   bool plausible() const;                             may be left out; whether a real calibration can be that wrong
//   double capped_error() const;                        px
//   static constexpr double kAsGood;                    a group of more unknowns must leave less than this share of the error
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "fbvins/checkup/finding.hpp"
#include "fbvins/doctor/block_fit.hpp"
#include "fbvins/doctor/lens_change.hpp"

namespace fbvins {

struct ChangeGroup {
  FindingKind kind;
  WhichLens lens;
  std::vector<int> unknowns;
  double practical;   ///< smallest norm of the amount that is reported
  double rarity = 1;  ///< its error counts so many times: of two causes that explain alike the common one is taken
};

inline bool is_free(std::span<const int> free, int unknown) { return std::find(free.begin(), free.end(), unknown) != free.end(); }

/// `free` with those of `more` that are not in it.
inline std::vector<int> with(std::vector<int> free, std::span<const int> more) {
  for (const int i : more)
    if (!is_free(free, i)) free.push_back(i);
  return free;
}

/// An amount and its covariance. Its significance is that of its most significant component.
struct Amount {
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;
  double sigmas() const {
    double most = 0;
    for (Eigen::Index i = 0; i < value.size(); ++i)
      most = std::max(most, std::abs(value(i)) / std::sqrt(std::max(covariance(i, i), 1e-30)));
    return most;
  }
};

/// A fit's estimate of a group that is free in it.
template <class Fit>
Amount amount_of(const ChangeGroup& group, const Fit& fit, const BlockSolution& solution) {
  std::vector<int> places;
  for (const int unknown : group.unknowns)
    places.push_back(static_cast<int>(std::find(fit.free.begin(), fit.free.end(), unknown) - fit.free.begin()));
  return {fit.x(group.unknowns), solution.covariance(places, places)};
}

template <class Fit>
struct Candidate {
  const ChangeGroup* group;
  Fit fit;
  BlockSolution solution;
  double error_px;
};

/// The group whose unknowns, estimated in addition to those that are free, leave the smallest error.
template <class Fit>
std::optional<Candidate<Fit>> best_candidate(const Fit& so_far, std::span<const ChangeGroup> groups) {
  std::optional<Candidate<Fit>> best;
  for (const ChangeGroup& group : groups) {
    if (is_free(so_far.free, group.unknowns.front())) continue;
    Candidate<Fit> candidate{&group, so_far, {}, 0};
    candidate.fit.free = with(so_far.free, group.unknowns);
    auto solution = candidate.fit.converge();
    if (!solution) continue;
    if constexpr (requires { candidate.fit.plausible(); })
      if (!candidate.fit.plausible()) continue;
    candidate.solution = std::move(*solution);
    candidate.error_px = candidate.fit.capped_error();
    const std::size_t n = group.unknowns.size(), n_best = best ? best->group->unknowns.size() : n;
    const double handicap = n < n_best ? Fit::kAsGood : n > n_best ? 1 / Fit::kAsGood : 1;
    if (!best || candidate.error_px * handicap * group.rarity < best->error_px * best->group->rarity)
      best.emplace(std::move(candidate));
  }
  return best;
}

/// Root mean square of the error that a change explains, from those before and after.
inline double explained_px(double before, double after) { return std::sqrt(std::max(before * before - after * after, 0.0)); }

}  // namespace fbvins
