// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/marker_faults.hpp"

#include "fbvins/core/median.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace fbvins {
namespace {

constexpr double kGap_periods = 3;
constexpr std::size_t kHeld_poses = 3;  // this many identical ones are no measurements
// Faster than any of these no indoor drone moves; the constants are the noise of a small rigid body.
constexpr double kFastest_mps = 15, kFastest_radps = 25, kStep_m = 0.05, kStep_rad = 0.17;

double angle_between(const MarkerPose& a, const MarkerPose& b) { return so3_log(a.T_VK.q.conjugate() * b.T_VK.q).norm(); }

bool can_follow(const MarkerPose& a, const MarkerPose& b) {
  const double dt = (b.t - a.t).seconds();
  return (b.T_VK.p - a.T_VK.p).norm() <= kFastest_mps * dt + kStep_m && angle_between(a, b) <= kFastest_radps * dt + kStep_rad;
}

bool same(const MarkerPose& a, const MarkerPose& b) { return a.T_VK.p == b.T_VK.p && a.T_VK.q.coeffs() == b.T_VK.q.coeffs(); }

struct Piece {
  std::size_t first, last;  ///< inclusive
  std::size_t size() const { return last - first + 1; }
};

/// Poses that hold still to the last digit: the first one stays.
void drop_held(const MarkerTrack& track, MarkerInspection& out) {
  for (std::size_t i = 0; i < track.size();) {
    std::size_t end = i + 1;
    while (end < track.size() && same(track[i], track[end])) ++end;
    if (end - i >= kHeld_poses) {
      out.faults.push_back({MarkerFaultKind::held, track[i].t, track[end - 1].t});
      std::fill(out.keep.begin() + static_cast<std::ptrdiff_t>(i) + 1, out.keep.begin() + static_cast<std::ptrdiff_t>(end),
                false);
    }
    i = end;
  }
}

std::vector<Piece> pieces_of(const MarkerTrack& track, const std::vector<bool>& keep) {
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < track.size(); ++i) {
    if (!keep[i]) continue;
    if (!pieces.empty() && can_follow(track[pieces.back().last], track[i])) pieces.back().last = i;
    else pieces.push_back({i, i});
  }
  return pieces;
}

/// The chain of pieces that follow one another with the most poses in it: what is between is another body's.
std::vector<bool> longest_chain(const MarkerTrack& track, const std::vector<Piece>& pieces) {
  constexpr std::size_t kReach = 200;  // pieces back
  std::vector<std::size_t> weight(pieces.size()), before(pieces.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    weight[i] = pieces[i].size(), before[i] = i;
    for (std::size_t k = i > kReach ? i - kReach : 0; k < i; ++k) {
      const std::size_t sum = weight[k] + pieces[i].size();
      if (sum > weight[i] && can_follow(track[pieces[k].last], track[pieces[i].first])) weight[i] = sum, before[i] = k;
    }
  }
  std::vector<bool> chosen(pieces.size(), false);
  if (pieces.empty()) return chosen;
  auto i = static_cast<std::size_t>(std::max_element(weight.begin(), weight.end()) - weight.begin());
  for (chosen[i] = true; before[i] != i; chosen[i] = true) i = before[i];
  return chosen;
}

void drop_jumps(const MarkerTrack& track, MarkerInspection& out) {
  const std::vector<Piece> pieces = pieces_of(track, out.keep);
  const std::vector<bool> chosen = longest_chain(track, pieces);
  const MarkerPose* home = nullptr;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Piece& piece = pieces[i];
    if (chosen[i]) {
      home = &track[piece.last];
      continue;
    }
    const MarkerPose& first = track[piece.first];
    MarkerFault fault{MarkerFaultKind::jump, first.t, track[piece.last].t};
    const MarkerPose& from = home ? *home : track[pieces[std::min(i + 1, pieces.size() - 1)].first];
    fault.distance_m = (first.T_VK.p - from.T_VK.p).norm();
    fault.angle_rad = angle_between(from, first);
    out.faults.push_back(fault);
    std::fill(out.keep.begin() + static_cast<std::ptrdiff_t>(piece.first),
              out.keep.begin() + static_cast<std::ptrdiff_t>(piece.last) + 1, false);
  }
}

void find_gaps(const MarkerTrack& track, MarkerInspection& out) {
  const double longest_s = kGap_periods / out.rate_hz;
  double unseen_s = 0;
  for (std::size_t i = 1; i < track.size(); ++i) {
    const double dt = (track[i].t - track[i - 1].t).seconds();
    if (dt <= longest_s) continue;
    unseen_s += dt;
    out.faults.push_back({MarkerFaultKind::gap, track[i - 1].t, track[i].t});
  }
  out.unseen_share = unseen_s / (track.back().t - track.front().t).seconds();
}

}  // namespace

std::string_view to_string(MarkerFaultKind kind) {
  constexpr std::array<std::string_view, 5> kNames = {"gap", "held", "jump", "flip", "swap"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string to_string(const MarkerFault& fault, Time start) {
  const double degrees = fault.angle_rad * 180 / std::numbers::pi;
  std::string what(to_string(fault.kind));
  if (fault.kind == MarkerFaultKind::flip) what += fmt::format(" by {:.1f} degrees", degrees);
  if (fault.kind == MarkerFaultKind::swap) what += fmt::format(" by {:.3f} m", fault.distance_m);
  if (fault.kind == MarkerFaultKind::jump) what += fmt::format(" by {:.3f} m and {:.1f} degrees", fault.distance_m, degrees);
  return fmt::format("{}, {:.3f} s to {:.3f} s", what, (fault.from - start).seconds(), (fault.to - start).seconds());
}

MarkerTrack MarkerInspection::kept(const MarkerTrack& track) const {
  MarkerTrack out;
  for (std::size_t i = 0; i < track.size(); ++i)
    if (keep[i]) out.push_back(track[i]);
  return out;
}

MarkerInspection inspect(const MarkerTrack& track) {
  MarkerInspection out;
  out.keep.assign(track.size(), true);
  if (track.size() < 2) return out;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < track.size(); ++i) intervals.push_back((track[i].t - track[i - 1].t).seconds());
  const double period = median_of(intervals);
  out.rate_hz = 1 / period;
  for (double& interval : intervals) interval = std::abs(interval - period);
  out.jitter_s = median_of(intervals);
  find_gaps(track, out);
  drop_held(track, out);
  drop_jumps(track, out);
  std::stable_sort(out.faults.begin(), out.faults.end(),
                   [](const MarkerFault& a, const MarkerFault& b) { return a.from < b.from; });
  return out;
}

}  // namespace fbvins
