// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/association.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>

namespace fbvins {
namespace {

bool earlier(const StampedPose& a, const StampedPose& b) { return a.t < b.t; }

void sort_by_time(Trajectory& trajectory) { std::stable_sort(trajectory.begin(), trajectory.end(), earlier); }

Trajectory::const_iterator first_after(const Trajectory& sorted, Time t) {
  return std::upper_bound(sorted.begin(), sorted.end(), StampedPose{t, {}}, earlier);
}

const StampedPose* nearest(const Trajectory& sorted, Time t, Duration max_difference) {
  const auto after = first_after(sorted, t);
  const StampedPose* best = nullptr;
  if (after != sorted.begin()) best = &*std::prev(after);
  if (after != sorted.end() && (!best || after->t - t < t - best->t)) best = &*after;
  if (best && std::abs((best->t - t).ns) > max_difference.ns) return nullptr;
  return best;
}

std::optional<StampedPose> interpolate(const Trajectory& sorted, Time t, Duration max_hole) {
  const auto after = first_after(sorted, t);
  if (after == sorted.begin()) return std::nullopt;
  const StampedPose& a = *std::prev(after);
  if (a.t == t) return a;
  if (after == sorted.end() || after->t - a.t > max_hole) return std::nullopt;
  const double u = (t - a.t).seconds() / (after->t - a.t).seconds();
  const Vec3 p = a.T_WB.p + u * (after->T_WB.p - a.T_WB.p);
  return StampedPose{t, {a.T_WB.q.slerp(u, after->T_WB.q).normalized(), p}};
}

}  // namespace

std::vector<PosePair> associate(Trajectory truth, Trajectory estimate, const AssociationOptions& options) {
  sort_by_time(truth);
  sort_by_time(estimate);
  std::vector<PosePair> pairs;
  if (options.method == AssociationMethod::interpolate_truth) {
    const Duration max_hole = Duration::from_seconds(options.max_interpolation_s);
    for (const StampedPose& pose : estimate)
      if (auto at = interpolate(truth, pose.t, max_hole)) pairs.push_back({*at, pose});
    return pairs;
  }
  const Duration max_difference = Duration::from_seconds(options.max_difference_s);
  const bool truth_is_short = truth.size() < estimate.size();
  for (const StampedPose& pose : truth_is_short ? truth : estimate)
    if (const StampedPose* other = nearest(truth_is_short ? estimate : truth, pose.t, max_difference))
      pairs.push_back(truth_is_short ? PosePair{pose, *other} : PosePair{*other, pose});
  return pairs;
}

}  // namespace fbvins
