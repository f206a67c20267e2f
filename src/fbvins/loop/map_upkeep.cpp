// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_upkeep.hpp"

#include <algorithm>
#include <map>

#include "fbvins/core/angle.hpp"
#include "fbvins/loop/map_edges.hpp"

namespace fbvins {
namespace {

/// From so near, and in so near a direction, a flight sees what an older keyframe shows; it is compared with so many of the
/// nearest.
constexpr double kSees_m = 0.5, kSees_rad = 20 * kDegree;
constexpr std::size_t kCompared = 2;
/// So near, with this share of the visible points known again, a new keyframe brings nothing: it looks the same from the same
/// place.
constexpr double kSame_m = 0.2, kSame_rad = 12 * kDegree, kSameShare = 0.4;
/// But one of a session stays every so often: its loops tie the older keyframes to one another.
constexpr double kSkeleton_m = 1.5, kSkeleton_s = 3;
/// Sessions in a row that stood there and did not know it again, after which a keyframe leaves.
constexpr int kMissed = 5;
/// Views that one spot needs at most: of other light, other furniture. Successive keyframes of one flight are further apart.
constexpr std::size_t kViews = 4;
constexpr double kSpot_m = 0.15, kSpot_rad = 8 * kDegree;
/// Around where the poses predict a point.
constexpr double kSearch_px = 30;

using Pairs = std::map<KeyframeId, std::set<KeyframeId>>;  // a flown keyframe, and the older ones to compare with

class Upkeep {
 public:
  Upkeep(PlaceMap& map, const std::set<std::uint32_t>& flown, PlaceVerifier& verifier)
      : map_(map), flown_(flown), verifier_(verifier) {
    for (MapKeyframe& k : map.keyframes())
      if (k.placed) (is_flown(k) ? new_ : old_).push_back(&k);
  }

  std::vector<KeyframeId> run() {
    compare();
    for (MapKeyframe* k : old_)
      if (looked_at_.count(k->id) > 0) k->missed = seen_.count(k->id) > 0 ? 0 : k->missed + 1;
    leave_what_is_known();
    for (const MapKeyframe* k : old_)
      if (k->missed >= kMissed) leave(*k);
    thin_spots();
    return {gone_.begin(), gone_.end()};
  }

 private:
  /// Between the cameras that saw their places.
  double angle_between_views(const MapKeyframe& a, const MapKeyframe& b) const {
    return angle_between(map_.T_MC(a).q, map_.T_MC(b).q);
  }
  bool within(const MapKeyframe& a, const MapKeyframe& b, double metres, double rad) const {
    return (a.T_MB.p - b.T_MB.p).squaredNorm() < metres * metres && angle_between_views(a, b) < rad;
  }
  bool is_flown(const MapKeyframe& k) const { return flown_.count(k.session) > 0; }
  void leave(const MapKeyframe& k) {
    if (k.id != map_.keyframes().front().id) gone_.insert(k.id);
  }

  /// Each old keyframe that the flight could see, with the nearest of the flight.
  Pairs pairs() {
    Pairs all;
    for (const MapKeyframe* old : old_) {
      std::vector<std::pair<double, KeyframeId>> near;
      for (const MapKeyframe* k : new_)
        if (within(*old, *k, kSees_m, kSees_rad))
          near.emplace_back((old->T_MB.p - k->T_MB.p).norm() + angle_between_views(*old, *k), k->id);
      if (near.empty()) continue;
      looked_at_.insert(old->id);
      std::sort(near.begin(), near.end());
      for (std::size_t i = 0; i < std::min(kCompared, near.size()); ++i) all[near[i].second].insert(old->id);
    }
    for (const MapKeyframe* k : new_)
      for (const MapKeyframe* old : old_)
        if (std::set<KeyframeId>& with = all[k->id]; with.size() < 2 * kCompared && within(*old, *k, kSame_m, kSame_rad))
          with.insert(old->id);
    return all;
  }

  void compare() {
    for (const auto& [id, with] : pairs()) {
      const MapKeyframe& k = *map_.find(id);
      const std::shared_ptr<const Place> place = map_.place_of(k);
      verifier_.set_query(*place);
      for (const KeyframeId other : with) {
        const MapKeyframe& old = *map_.find(other);
        const auto found = verifier_.verify(*map_.place_of(old), {map_.T_MC(k).inverse() * map_.T_MC(old), kSearch_px});
        if (!found) continue;
        seen_.insert(other);
        if (within(old, k, kSame_m, kSame_rad) && static_cast<double>(found->pose.inliers.size()) > kSameShare * found->visible)
          known_.insert(id);
      }
    }
    for (const MapEdge& e : map_.edges)
      if (e.kind == MapEdge::Kind::loop && is_flown(*map_.find(e.from)) != is_flown(*map_.find(e.to)))
        seen_.insert(is_flown(*map_.find(e.from)) ? e.to : e.from);
  }

  void leave_what_is_known() {
    const MapKeyframe* last = nullptr;
    for (const MapKeyframe* k : new_) {
      const bool needed = last == nullptr || last->session != k->session || (k->T_MB.p - last->T_MB.p).norm() > kSkeleton_m ||
                          (k->t - last->t).seconds() > kSkeleton_s;
      if (needed || known_.count(k->id) == 0) last = k;
      else leave(*k);
    }
  }

  /// Of more views than a spot needs, those that were missed most often, then those known again least, then the newest.
  void thin_spots() {
    std::vector<const MapKeyframe*> all;
    for (const MapKeyframe& k : map_.keyframes())
      if (k.placed && gone_.count(k.id) == 0) all.push_back(&k);
    const auto worse = [](const MapKeyframe* a, const MapKeyframe* b) {
      if (a->missed != b->missed) return a->missed > b->missed;
      if (a->loops_ending_here != b->loops_ending_here) return a->loops_ending_here < b->loops_ending_here;
      return a->id > b->id;
    };
    for (const MapKeyframe* k : new_) {
      std::vector<const MapKeyframe*> here;
      for (const MapKeyframe* other : all)
        if (gone_.count(other->id) == 0 && within(*k, *other, kSpot_m, kSpot_rad)) here.push_back(other);
      std::sort(here.begin(), here.end(), worse);
      for (std::size_t i = 0; i + kViews < here.size(); ++i) leave(*here[i]);
    }
  }

  PlaceMap& map_;
  const std::set<std::uint32_t>& flown_;
  PlaceVerifier& verifier_;
  std::vector<MapKeyframe*> old_, new_;
  std::set<KeyframeId> looked_at_, seen_, known_, gone_;
};

}  // namespace

std::vector<KeyframeId> what_leaves(PlaceMap& map, const std::set<std::uint32_t>& flown, PlaceVerifier& verifier) {
  if (map.empty() || flown.empty()) return {};
  return Upkeep(map, flown, verifier).run();
}

}  // namespace fbvins
