// SPDX-License-Identifier: Apache-2.0
// The part of LoopCloser that takes tags whose place nobody has measured as landmarks (docs/derivations/loop.md, L27).
#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_edges.hpp"
#include "fbvins/loop/map_tags.hpp"

namespace fbvins {
namespace {

/// Of one keyframe by one tag: more would say the same again.
constexpr int kMostTies = 2;

}  // namespace

/// As the newest keyframe of the map shows it.
std::optional<MapTag> LoopCloser::tag_of_newest(const TagAnchor& anchor) const {
  const MapKeyframe& newest = *map_.find(session_.newest());
  const std::optional<Pose<G, B>> T_GB = session_.motion().at(anchor.t);
  if (!T_GB) return std::nullopt;
  const Pose<B, B> T = newest.T_GB.inverse() * *T_GB;
  const DriftVariance drift = drift_over(session_.drift(), T.p.norm(), std::abs((anchor.t - newest.t).seconds()));
  Mat6 covariance = Mat6::Zero();
  covariance.diagonal() << Vec3::Constant(drift.position_m2), Vec3::Constant(drift.yaw_rad2);
  return carried(MapTag{newest.id, anchor.id, anchor.T_BT, anchor.covariance}, newest.id, T, covariance);
}

/// Keyframes that do not enter the map show what the newest one of it shows.
void LoopCloser::take_tags(const Keyframe& keyframe, MapUpdate& update) {
  for (const Anchor& anchor : keyframe.anchors) {
    const auto* tag = std::get_if<TagAnchor>(&anchor);
    if (tag == nullptr || tag->has_place() || map_.find(session_.newest())->t != keyframe.t) continue;
    const std::optional<MapTag> now = tag_of_newest(*tag);
    if (!now) {
      ++update.stats.anchors_refused;
      continue;
    }
    int ties = 0;
    for (const MapTag* before : tags_before(map_, *now))
      if (ties < kMostTies && tie(*before, *now, update)) ++ties;
    remember_tag(map_, *now);
  }
}

bool LoopCloser::tie(const MapTag& before, const MapTag& now, MapUpdate& update) {
  MapKeyframe &k = *map_.find(before.keyframe), &newest = *map_.find(now.keyframe);
  const MapEdge edge = tag_edge(before, now);
  const MeasuredPose seen = measured_pose(k, edge);
  if (frame_.known()) {
    if (!take(k, seen)) {
      ++update.stats.anchors_refused;
      return false;
    }
  } else {
    const std::optional<Pose<M, G>> T_MG = relocaliser_.consider(newest, session_.q_LG(), seen.T_MB, {}, now.id);
    if (!T_MG) return false;
    found_at(*T_MG, seen);
  }
  newest.T_MB = frame_.T_MG() * newest.T_GB;
  if (k.session != session_.number()) ++map_.session(session_.number(), newest.t).loops;
  ++k.loops_ending_here;
  map_.edges.push_back(edge);
  update.loops.push_back({edge.from, edge.to, edge.T_from_to, edge.information, 0});
  ++update.stats.accepted;
  ++news_since_optimised_;
  return true;
}

}  // namespace fbvins
