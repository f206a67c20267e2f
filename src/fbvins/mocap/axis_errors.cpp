// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/axis_errors.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace fbvins {
namespace {

constexpr double kHover_mps = 0.1, kHover_s = 1, kSpeedOver_s = 0.2;

bool earlier(const StampedPose<W>& a, const StampedPose<W>& b) { return a.t < b.t; }

/// Mean position, nullopt where there is no pose.
std::optional<Vec3> mean_in(const Trajectory<W>& poses, const HoverSpan& span) {
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (auto pose = std::lower_bound(poses.begin(), poses.end(), StampedPose<W>{span.from, {}}, earlier);
       pose != poses.end() && pose->t <= span.to; ++pose)
    sum += pose->T.p, ++count;
  if (count == 0) return std::nullopt;
  return sum / count;
}

}  // namespace

std::optional<HoverPair> find_hovers(const Trajectory<W>& truth) {
  std::vector<HoverSpan> hovers;
  bool inside = false;
  std::size_t before = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    while ((truth[i].t - truth[before].t).seconds() > kSpeedOver_s) ++before;
    const double dt = (truth[i].t - truth[before].t).seconds();
    const bool slow = dt > 0.5 * kSpeedOver_s && (truth[i].T.p - truth[before].T.p).norm() < kHover_mps * dt;
    if (slow && !inside) hovers.push_back({truth[i].t, truth[i].t});
    if (slow) hovers.back().to = truth[i].t;
    inside = slow;
  }
  std::erase_if(hovers, [](const HoverSpan& span) { return (span.to - span.from).seconds() < kHover_s; });
  if (hovers.size() < 2) return std::nullopt;
  return HoverPair{hovers.front(), hovers.back()};
}

Result<AxisErrors> axis_errors(const Trajectory<W>& truth, const Trajectory<W>& estimate, const HoverSpan& start,
                               const HoverSpan& end, const std::optional<Vec3>& expected) {
  AxisErrors out;
  out.start = start, out.end = end;
  struct Place {
    const Trajectory<W>& poses;
    const HoverSpan& span;
    Vec3& mean;
    const char* what;
  };
  for (const Place& place : {Place{truth, start, out.truth_start, "motion capture at the start"},
                             {truth, end, out.truth_end, "motion capture at the end"},
                             {estimate, start, out.estimate_start, "estimate at the start"},
                             {estimate, end, out.estimate_end, "estimate at the end"}}) {
    const auto mean = mean_in(place.poses, place.span);
    if (!mean)
      return Error{ErrorCode::invalid_argument, fmt::format("there is no {}, {:.3f} s to {:.3f} s", place.what,
                                                            place.span.from.seconds(), place.span.to.seconds())};
    place.mean = *mean;
  }
  out.expected = expected.value_or(out.estimate_difference());
  return out;
}

}  // namespace fbvins
