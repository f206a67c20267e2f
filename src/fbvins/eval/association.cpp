// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/association.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>

namespace fbvins {
namespace {

using Poses = Trajectory<AnyWorld>;
using At = StampedPose<AnyWorld>;

bool earlier(const At& a, const At& b) { return a.t < b.t; }

void sort_by_time(Poses& trajectory) { std::stable_sort(trajectory.begin(), trajectory.end(), earlier); }

Poses::const_iterator first_after(const Poses& sorted, Time t) {
  return std::upper_bound(sorted.begin(), sorted.end(), At{t, {}}, earlier);
}

const At* nearest(const Poses& sorted, Time t, Duration max_difference) {
  const auto after = first_after(sorted, t);
  const At* best = nullptr;
  if (after != sorted.begin()) best = &*std::prev(after);
  if (after != sorted.end() && (!best || after->t - t < t - best->t)) best = &*after;
  if (best && std::abs((best->t - t).ns) > max_difference.ns) return nullptr;
  return best;
}

std::optional<At> interpolate(const Poses& sorted, Time t, Duration max_hole) {
  const auto after = first_after(sorted, t);
  if (after == sorted.begin()) return std::nullopt;
  const At& a = *std::prev(after);
  if (a.t == t) return a;
  if (after == sorted.end() || after->t - a.t > max_hole) return std::nullopt;
  const double u = (t - a.t).seconds() / (after->t - a.t).seconds();
  const Vec3 p = a.T.p + u * (after->T.p - a.T.p);
  return At{t, {a.T.q.slerp(u, after->T.q).normalized(), p}};
}

}  // namespace

std::vector<PosePair> associate(AnyTrajectory any_truth, AnyTrajectory any_estimate, const AssociationOptions& options) {
  Poses &truth = any_truth.poses, &estimate = any_estimate.poses;
  sort_by_time(truth);
  sort_by_time(estimate);
  std::vector<PosePair> pairs;
  if (options.method == AssociationMethod::interpolate_truth) {
    const Duration max_hole = Duration::from_seconds(options.max_interpolation_s);
    for (const At& pose : estimate)
      if (auto at = interpolate(truth, pose.t, max_hole)) pairs.push_back({*at, pose});
    return pairs;
  }
  const Duration max_difference = Duration::from_seconds(options.max_difference_s);
  const bool truth_is_short = truth.size() < estimate.size();
  for (const At& pose : truth_is_short ? truth : estimate)
    if (const At* other = nearest(truth_is_short ? estimate : truth, pose.t, max_difference))
      pairs.push_back(truth_is_short ? PosePair{pose, *other} : PosePair{*other, pose});
  return pairs;
}

}  // namespace fbvins
