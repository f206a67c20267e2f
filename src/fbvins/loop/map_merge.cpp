// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_merge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

#include "fbvins/loop/map_consistency.hpp"
#include "fbvins/loop/map_edges.hpp"
#include "fbvins/loop/map_sessions.hpp"
#include "fbvins/loop/map_tags.hpp"
#include "fbvins/loop/map_upkeep.hpp"

namespace fbvins {
namespace {

/// Keyframes of the second map that are looked for anywhere in the first: of more, evenly so many. So many that agree are needed;
/// with more, no others are looked for.
constexpr std::size_t kMostAsked = 300, kAgree = 3, kEnough = 8;
/// Or so many tags by their numbers: one number may hang in two buildings.
constexpr std::size_t kAgreeingTags = 2;
/// Largest difference of two recognised places that agree on where the second map lies.
constexpr double kAgree_m = 0.3, kAgree_rad = 3 * kDegree;
/// Once that is known, places are recognised around their predicted pose, which is as uncertain as this.
constexpr double kKnown_m = 0.3, kKnown_px = 40;
/// Of the second map's keyframes; with more it has little of its own.
constexpr double kMostInBoth = 0.5;

/// Keyframes of `second` with a keyframe of `first` of the same image: of the same stamp, with the same features.
std::vector<KeyframeId> keyframes_in_both(const PlaceMap& first, const PlaceMap& second) {
  std::multimap<Time, const Place*> of_first;
  for (const MapKeyframe& k : first.keyframes()) of_first.emplace(k.t, &k.place);
  std::vector<KeyframeId> both;
  for (const MapKeyframe& k : second.keyframes()) {
    const auto [begin, end] = of_first.equal_range(k.t);
    if (std::any_of(begin, end, [&](const auto& other) {
          return other.second->features == k.place.features && other.second->descriptors == k.place.descriptors;
        }))
      both.push_back(k.id);
  }
  return both;
}

/// A place or a tag of the first map, seen by a keyframe of the second.
struct Tie {
  MapEdge edge;  ///< from the first's keyframe to the second's, under its number there
  Vec3 p_M2;     ///< of the second's keyframe
  Vec3 p_M1;     ///< where the tie puts it
  Pose<M, M> T_M1_M2;
  std::optional<int> tag;  ///< its number

  bool agrees(const Pose<M, M>& T) const {
    return (T * p_M2 - p_M1).norm() < kAgree_m && angle_between(T.q, T_M1_M2.q) < kAgree_rad;
  }
};

class Merge {
 public:
  /// Both in the body of the first's rig, with words and one numbering of cameras.
  Merge(const PlaceMap& first, const PlaceMap& second, const LoopOptions& options, const Vocabulary& vocabulary)
      : first_(first),
        second_(second),
        verifier_(first.boosted ? for_boosted(options.verification) : options.verification),
        search_(vocabulary.words(), options.max_distance_m) {
    for (const MapKeyframe& k : first.keyframes()) search_.add(k.id, k.place.words);
  }

  /// Where the second map lies in the first, by the most places and tags that agree.
  std::optional<Pose<M, M>> find() {
    const std::size_t count = second_.size(), asked = std::min(count, kMostAsked);
    std::vector<Tie> ties = tag_ties();
    std::size_t most = 0;
    std::optional<Pose<M, M>> best;
    const auto choose = [&] {
      for (const Tie& hypothesis : ties)
        if (const std::size_t n = supporters(ties, hypothesis.T_M1_M2); n > most) most = n, best = hypothesis.T_M1_M2;
    };
    choose();
    for (std::size_t i = 0; i < asked && most < kEnough; ++i) {
      MapKeyframe query = second_.keyframes()[i * count / asked];
      query.session = kNoSession;
      verifier_.set_query(query.place);
      for (const KeyframeId id : search_.anywhere(first_, query)) {
        const MapKeyframe& known = *first_.find(id);
        if (const auto verified = verifier_.verify(known.place)) ties.push_back(tie_of(known, query, *verified));
      }
      choose();
    }
    return best && (most >= kAgree || agreeing_tags(ties, *best) >= kAgreeingTags) ? best : std::nullopt;
  }

  /// Tags and places that both know, these around where they should be.
  std::vector<MapEdge> ties(const Pose<M, M>& T_M1_M2) {
    std::vector<MapEdge> out;
    for (Tie& tie : tag_ties())
      if (tie.agrees(T_M1_M2)) out.push_back(std::move(tie.edge));
    for (const MapKeyframe& k : second_.keyframes()) {
      MapKeyframe query = k;
      query.session = kNoSession;
      query.T_MB = T_M1_M2 * k.T_MB;
      verifier_.set_query(query.place);
      for (const KeyframeId id : search_.around(first_, query, kKnown_m)) {
        const MapKeyframe& known = *first_.find(id);
        const CameraFromCamera T_qc = first_.T_MC(query).inverse() * first_.T_MC(known);
        if (const auto verified = verifier_.verify(known.place, {T_qc, kKnown_px}))
          out.push_back(tie_of(known, query, *verified).edge);
      }
    }
    return out;
  }

 private:
  static constexpr std::uint32_t kNoSession = 0xffffffff;

  Tie tie_of(const MapKeyframe& known, const MapKeyframe& query, const VerifiedPose& verified) const {
    MapEdge edge = loop_edge(first_.T_BC(known), first_.T_BC(query), known.id, verified.pose);
    edge.to = query.id;
    return tie_by(std::move(edge), known, query);
  }

  static Tie tie_by(MapEdge edge, const MapKeyframe& known, const MapKeyframe& query, std::optional<int> tag = {}) {
    const Pose<M, B> seen = known.T_MB * edge.T_from_to;
    const Quat turn = about_z(yaw_of(seen.q * query.T_MB.q.conjugate()));
    return {std::move(edge), query.T_MB.p, seen.p, {turn, Vec3(seen.p - turn * query.T_MB.p)}, tag};
  }

  /// Of tags whose places in the building nobody has measured, every view with every other.
  std::vector<Tie> tag_ties() const {
    std::vector<Tie> out;
    for (const MapTag& before : first_.tags)
      for (const MapTag& now : second_.tags) {
        const MapKeyframe *known = first_.find(before.keyframe), *query = second_.find(now.keyframe);
        if (before.id == now.id && known != nullptr && query != nullptr)
          out.push_back(tie_by(tag_edge(before, now), *known, *query, now.id));
      }
    return out;
  }

  static std::size_t agreeing_tags(const std::vector<Tie>& ties, const Pose<M, M>& T) {
    std::set<int> agreeing;
    for (const Tie& tie : ties)
      if (tie.tag && tie.agrees(T)) agreeing.insert(*tie.tag);
    return agreeing.size();
  }

  /// Keyframes of the second map.
  static std::size_t supporters(const std::vector<Tie>& ties, const Pose<M, M>& T) {
    std::set<KeyframeId> agreeing;
    for (const Tie& tie : ties)
      if (tie.agrees(T)) agreeing.insert(tie.edge.to);
    return agreeing.size();
  }

  const PlaceMap& first_;
  const PlaceMap& second_;
  PlaceVerifier verifier_;
  CandidateSearch search_;
};

/// Adds all that is in `second`; its sessions are numbered on. Returns the new ids of its keyframes.
std::map<KeyframeId, KeyframeId> append(PlaceMap& map, const PlaceMap& second, const Pose<M, M>& T_M1_M2,
                                        std::uint32_t first_session) {
  std::map<KeyframeId, KeyframeId> renamed;
  for (MapKeyframe k : second.keyframes()) {
    const KeyframeId old = k.id;
    k.id = {};
    k.session += first_session;
    k.T_MB = T_M1_M2 * k.T_MB;
    renamed[old] = map.add(std::move(k));
  }
  for (MapSession s : second.sessions) {
    s.number += first_session;
    map.sessions.push_back(s);
  }
  for (MapEdge e : second.edges) {
    e.from = renamed.at(e.from), e.to = renamed.at(e.to);
    map.edges.push_back(std::move(e));
  }
  if (map.anchored && second.anchored)
    for (MapAnchor a : second.anchors) {
      a.keyframe = renamed.at(a.keyframe);
      map.anchors.push_back(std::move(a));
    }
  for (MapTag t : second.tags) {
    t.keyframe = renamed.at(t.keyframe);
    map.tags.push_back(std::move(t));
  }
  return renamed;
}

void count_loops(PlaceMap& map, const MapEdge& tie) {
  for (const KeyframeId id : {tie.from, tie.to}) {
    const MapKeyframe& k = *map.find(id);
    ++map.session(k.session, k.t).loops;
  }
  ++map.find(tie.from)->loops_ending_here;
}

/// As after a flight, where there are more keyframes than `thin_above`.
void thin(PlaceMap& map, std::uint32_t first_session, const LoopOptions& options) {
  if (static_cast<int>(map.size()) <= options.thin_above) return;
  std::set<std::uint32_t> joined;
  for (const MapKeyframe& k : map.keyframes())
    if (k.session >= first_session) joined.insert(k.session);
  PlaceVerifier verifier(map.boosted ? for_boosted(options.verification) : options.verification);
  for (const KeyframeId id : what_leaves(map, joined, verifier)) map.remove(id);
  Thinning thinning(options.thin_above, options.max_keyframes);
  while (const auto id = thinning.next(map)) map.remove(*id);
}

}  // namespace

Result<PlaceMap> merge_maps(PlaceMap first, const PlaceMap& other, const LoopOptions& options, const Vocabulary& vocabulary) {
  const auto refuse = [](std::string why) { return Error{ErrorCode::invalid_argument, std::move(why)}; };
  if (first.boosted != other.boosted) return refuse("one map holds boosted descriptors, the other raw ones");
  PlaceMap second = other;
  const std::vector<KeyframeId> both = keyframes_in_both(first, second);
  if (both.size() > kMostInBoth * static_cast<double>(second.size()))
    return refuse(fmt::format("{} of its {} keyframes are in the other map already", both.size(), second.size()));
  for (const KeyframeId id : both) second.remove(id);  // where recordings of one flight overlap
  change_body(second, first.cameras[0]);
  for (MapKeyframe& k : second.keyframes()) k.camera = first.camera_at(second.T_BC(k));
  second.cameras = first.cameras;
  for (PlaceMap* map : {&first, &second}) {
    std::erase_if(map->keyframes(), [](const MapKeyframe& k) { return !k.placed; });
    std::erase_if(map->edges, [&](const MapEdge& e) { return map->find(e.from) == nullptr || map->find(e.to) == nullptr; });
    map->fill_words(vocabulary);
    remember_sessions(*map);
  }
  Merge merge(first, second, options, vocabulary);
  const std::optional<Pose<M, M>> T_M1_M2 = merge.find();
  if (!T_M1_M2) return refuse("the two maps have no place in common");
  const std::vector<MapEdge> ties = merge.ties(*T_M1_M2);
  const std::uint32_t first_session = first.sessions.empty() ? 0 : first.sessions.back().number + 1;
  const std::map<KeyframeId, KeyframeId> renamed = append(first, second, *T_M1_M2, first_session);
  const InPart is_second = [&](std::uint32_t session) { return session >= first_session; };
  const PartFit before = fit_of(first, is_second);
  for (MapEdge tie : ties) {
    tie.to = renamed.at(tie.to);
    count_loops(first, tie);
    first.edges.push_back(std::move(tie));
  }
  first.optimise({options.degrees_of_freedom});
  if (const std::string why = objection(before, fit_of(first, is_second)); !why.empty())
    return refuse("the two maps do not fit where they have places in common: of the second, " + why);
  thin(first, first_session, options);
  return first;
}

MergedMaps merge_all(std::vector<PlaceMap> maps, const LoopOptions& options, const Vocabulary& vocabulary) {
  MergedMaps out{std::move(maps.at(0)), {}};
  std::map<std::size_t, std::string> open;  // what was said of those that did not join yet
  for (std::size_t i = 1; i < maps.size(); ++i) open[i];
  for (bool progress = true; progress && !open.empty();) {
    progress = false;
    for (auto next = open.begin(); next != open.end();) {
      Result<PlaceMap> both = merge_maps(out.map, maps[next->first], options, vocabulary);
      if (both) {
        out.map = *std::move(both);
        progress = true;
        next = open.erase(next);
      } else {
        next->second = both.error().message;
        ++next;
      }
    }
  }
  for (auto& [index, why] : open) out.left_out.push_back({index, std::move(why)});
  return out;
}

}  // namespace fbvins
