// SPDX-License-Identifier: Apache-2.0
// The part of LoopCloser by which a flight is found in a map that others began, or anew.
#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_edges.hpp"

namespace fbvins {
namespace {

/// Prior of T_MG at relocalisation, before the recognised pose is applied as a measurement.
constexpr double kFoundSigma_m = 0.05, kFoundSigma_rad = 0.01;

}  // namespace

/// The first places that a flight of one camera recognises have depths of a poor scale, and so has where they put it. Until a
/// place confirms that, others may find it anew.
bool LoopCloser::find_again(MapKeyframe& query, const Proposal& proposal, const MeasuredPose& seen) {
  if (session_.confirmed() || !session_.needs_scale()) return false;
  const std::optional<Pose<M, G>> T_MG = relocaliser_.consider(query, session_.q_LG(), seen.T_MB, proposal.verified);
  if (T_MG) found_at(*T_MG, seen);
  return T_MG.has_value();
}

void LoopCloser::found_at(const Pose<M, G>& T_MG, const MeasuredPose& seen) {
  frame_.reset(T_MG, kFoundSigma_m, kFoundSigma_rad);
  frame_.update(seen);
  session_.see(seen);
  join_session(frame_.T_MG());
}

void LoopCloser::relocalise(MapKeyframe& query, const std::vector<Proposal>& proposals, std::vector<MapEdge>& found) {
  for (const Proposal& proposal : proposals) {
    const MapKeyframe& k = *map_.find(proposal.candidate);
    const MeasuredPose seen = measured_pose(k, proposal.edge, metres_with(k));
    const std::optional<Pose<M, G>> T_MG = relocaliser_.consider(query, session_.q_LG(), seen.T_MB, proposal.verified);
    if (!T_MG) continue;
    found_at(*T_MG, seen);
    query.T_MB = frame_.T_MG() * query.T_GB;
    query.placed = true;
    found.push_back(proposal.edge);
    return;
  }
}

/// Gives the session's keyframes from before the relocalisation their poses in M.
void LoopCloser::join_session(const Pose<M, G>& T_MG) {
  for (MapKeyframe& k : map_.keyframes())
    if (k.session == session_.number()) k.T_MB = T_MG * k.T_GB, k.placed = true;
  relocaliser_.forget();
}

}  // namespace fbvins
