// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/flight_keyframes.hpp"

#include <algorithm>

namespace fbvins {
namespace {

/// Some hours of keyframes; 80 bytes each.
constexpr std::size_t kMost = 32768;

}  // namespace

void FlightKeyframes::add(Time t, KeyframeId id) {
  entries_.push_back({t, id, {}});
  if (entries_.size() <= kMost) return;
  const auto begin = entries_.begin(), middle = begin + kMost / 2;
  auto kept = begin;
  for (auto e = begin; e < middle; e += 2) *kept++ = *e;
  entries_.erase(kept, middle);
}

void FlightKeyframes::hand_over(KeyframeId gone, KeyframeId successor, const Pose<B, B>& T_successor_gone) {
  for (Entry& e : entries_)
    if (e.kept == gone) e.kept = successor, e.T_kept_B = T_successor_gone * e.T_kept_B;
}

void FlightKeyframes::drop(KeyframeId gone) {
  std::erase_if(entries_, [&](const Entry& e) { return e.kept == gone; });
}

Trajectory<M> FlightKeyframes::corrected(const PlaceMap& map, const Trajectory<G>& in_G) const {
  struct Knot {
    Time t;
    Pose<M, B> T_MB;
    Pose<G, B> T_GB;
  };
  std::vector<Knot> knots;
  for (const Entry& e : entries_) {
    const MapKeyframe* kept = map.find(e.kept);
    const auto at = std::lower_bound(in_G.begin(), in_G.end(), e.t, [](const StampedPose<G>& p, Time t) { return p.t < t; });
    if (kept == nullptr || !kept->placed || at == in_G.end() || at->t != e.t) continue;
    knots.push_back({e.t, kept->T_MB * e.T_kept_B, at->T});
  }
  Trajectory<M> out;
  if (knots.empty()) return out;
  std::size_t k = 0;
  for (const StampedPose<G>& p : in_G) {
    while (k + 1 < knots.size() && knots[k + 1].t <= p.t) ++k;
    const Pose<M, B> a = knots[k].T_MB * (knots[k].T_GB.inverse() * p.T);
    Pose<M, B> T_MB = a;
    if (k + 1 < knots.size() && p.t > knots[k].t) {
      const Pose<M, B> b = knots[k + 1].T_MB * (knots[k + 1].T_GB.inverse() * p.T);
      const double s = (p.t - knots[k].t).seconds() / (knots[k + 1].t - knots[k].t).seconds();
      T_MB = {a.q.slerp(s, b.q), Vec3((1 - s) * a.p + s * b.p)};
    }
    out.push_back({p.t, T_MB});
  }
  return out;
}

}  // namespace fbvins
