// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/loop_closer.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/stage_timer.hpp"
#include "fbvins/loop/final_adjustment.hpp"
#include "fbvins/loop/map_edges.hpp"

namespace fbvins {
namespace {

/// Roll and pitch of the map and of the odometry differ by about this.
constexpr double kTiltSigma_rad = 0.005;
/// Where a new map begins, W is where M is.
constexpr double kNewMapSigma_m = 1e-3, kNewMapSigma_rad = 1e-4;
/// What a first recognition is trusted with before it is weighed itself.
constexpr double kFoundSigma_m = 0.05, kFoundSigma_rad = 0.01;
/// A feature is looked for around where it is predicted: so far at least, three standard deviations farther (of a point at
/// a typical depth), and not at all by prediction where that is too wide.
constexpr double kNarrowestPrediction_px = 10, kPredictionSigmas = 3, kTypicalDepth_m = 2, kWidestPrediction_px = 45;
/// Loops until the graph is optimised; a large map waits for this share of its size.
constexpr int kOptimiseAfter = 24, kOptimiseShare = 4;
/// Differences of two rigs' bodies (m and rad together) below this are of rounding.
constexpr double kSameBody = 1e-9;

Pose<B, B> as_body(const Pose<B, C0>& T_BC0) { return {T_BC0.q, T_BC0.p}; }

double position_sigma_m(const Mat4& P) { return std::sqrt(P.topLeftCorner<3, 3>().trace()); }

PlaceVerifierOptions verification_for(const PlaceMap& map, const PlaceVerifierOptions& options) {
  return map.boosted ? for_boosted(options) : options;
}

}  // namespace

LoopCloser::LoopCloser(const StereoRig& rig, const LoopOptions& options, Vocabulary vocabulary)
    : LoopCloser(rig, options, std::move(vocabulary), PlaceMap{}) {}

LoopCloser::LoopCloser(const StereoRig& rig, const LoopOptions& options, Vocabulary vocabulary, PlaceMap map,
                       std::unique_ptr<DescriptorStage> stage)
    : options_(options),
      T_BC0_(rig.T_BC0),
      extractor_(rig, options.extraction, vocabulary, std::move(stage)),
      verifier_(verification_for(map, options.verification)),
      map_(std::move(map)),
      search_(vocabulary.words(), rig.T_BC0, options.max_distance_m),
      frame_(options.drift),
      follower_(options.follow_mps, options.follow_radps),
      thinning_(options.thin_above, options.max_keyframes) {
  // Places hang on the camera; another rig's body lies elsewhere.
  const Pose<B, B> T_old_new = as_body(map_.T_BC0) * as_body(T_BC0_).inverse();
  const bool moved = !map_.empty() && T_old_new.p.norm() + angle_between(T_old_new.q, Quat::Identity()) > kSameBody;
  for (MapKeyframe& k : map_.keyframes()) {
    if (moved) k.T_MB = k.T_MB * T_old_new;
    k.place.words = vocabulary.words_of(k.place.descriptors);
    search_.add(k.id, k.place.words);
    session_.number = std::max(session_.number, k.session);
  }
  map_.T_BC0 = T_BC0_;
}

MapUpdate LoopCloser::process(const Keyframe& keyframe) {
  CpuTimer timer;
  Place place = extractor_.extract(keyframe.images, keyframe.T_WB.R());
  const double extract_ms = timer.lap_ms();
  MapUpdate update = process(std::move(place), keyframe.id, keyframe.t, keyframe.T_WB, keyframe.reset_counter);
  update.stats.extract_ms = extract_ms;
  return update;
}

void LoopCloser::begin_session(std::uint32_t reset_counter) {
  session_ = {.number = session_.number + (session_.begun || !map_.empty()), .begun = true, .reset_counter = reset_counter};
  relocaliser_.forget();
  frame_.forget();
  follower_.forget();
  if (map_.empty()) frame_.reset({}, kNewMapSigma_m, kNewMapSigma_rad);
}

MapKeyframe LoopCloser::query_of(Place place, Time t, const Pose<W, B>& T_WB) {
  if (session_.T_WB) session_.path_m += (T_WB.p - session_.T_WB->p).norm();
  session_.T_WB = T_WB;
  frame_.advance(T_WB, t);
  return {{}, t, session_.number, T_WB, frame_.T_MW() * T_WB, session_.path_m, 0, frame_.known(), std::move(place)};
}

MapUpdate LoopCloser::process(Place place, FrameId frame, Time t, const Pose<W, B>& T_WB, std::uint32_t reset_counter) {
  if (!session_.begun || reset_counter != session_.reset_counter) begin_session(reset_counter);
  MapUpdate update;
  update.frame = frame;
  update.t = t;
  update.reset_counter = reset_counter;
  MapKeyframe query = query_of(std::move(place), t, T_WB);
  CpuTimer timer;
  const std::vector<KeyframeId> candidates = candidates_for(query);
  update.stats.recognise_ms = timer.lap_ms();
  const std::vector<Proposal> proposals = look_at(query, candidates);
  std::vector<MapEdge> found;
  if (frame_.known()) close(query, proposals, update, found);
  else relocalise(query, proposals, found);
  update.stats.verify_ms = timer.lap_ms();
  update.stats.candidates = static_cast<int>(candidates.size());
  add(std::move(query), found, update);
  if (optimisation_due()) optimise(update);
  while (const auto id = thinning_.next(map_)) take_out(*id);
  update.stats.optimise_ms = timer.lap_ms();
  update.stats.keyframes = static_cast<int>(map_.size());
  update.localised = frame_.known();
  update.map_session = session_.number;
  if (update.localised) {
    update.T_MW = frame_.T_MW();
    update.T_MW_smooth = follower_.follow(update.T_MW, T_WB, t);
  }
  return update;
}

std::vector<KeyframeId> LoopCloser::candidates_for(const MapKeyframe& query) {
  return frame_.known() ? search_.around(map_, query, position_sigma_m(frame_.covariance())) : search_.anywhere(map_, query);
}

std::vector<LoopCloser::Proposal> LoopCloser::look_at(const MapKeyframe& query, const std::vector<KeyframeId>& candidates) {
  std::vector<Proposal> proposals;
  if (candidates.empty()) return proposals;
  verifier_.set_query(query.place);
  const Mat4& P = frame_.covariance();
  const double sigma_rad = position_sigma_m(P) / kTypicalDepth_m + std::sqrt(P(3, 3));
  const double radius_px = kNarrowestPrediction_px + kPredictionSigmas * query.place.focal_px * sigma_rad;
  for (const KeyframeId id : candidates) {
    const MapKeyframe& k = *map_.find(id);
    std::optional<VerifiedPose> verified;
    if (frame_.known() && radius_px < kWidestPrediction_px) {
      const Pose<M, C0> T_MQ = query.T_MB * T_BC0_, T_MK = k.T_MB * T_BC0_;
      verified = verifier_.verify(k.place, {T_MQ.inverse() * T_MK, radius_px});
    } else {
      verified = verifier_.verify(k.place);
    }
    if (!verified) continue;
    const MapEdge edge = loop_edge(T_BC0_, id, verified->pose);
    proposals.push_back({id, std::move(*verified), edge});
  }
  return proposals;
}

void LoopCloser::close(MapKeyframe& query, const std::vector<Proposal>& proposals, MapUpdate& update,
                       std::vector<MapEdge>& found) {
  const double gate = options_.gate_sigma * options_.gate_sigma;
  for (const Proposal& proposal : proposals) {
    MapKeyframe& k = *map_.find(proposal.candidate);
    SeenPose seen = seen_pose(k, proposal.edge);
    // What the lever makes of a different roll and pitch is not drift.
    const double lever = (k.T_MB.p - seen.T_MB.p).norm() * kTiltSigma_rad;
    seen.covariance.diagonal().head<3>().array() += lever * lever;
    if (frame_.mahalanobis2(seen) > gate) {
      ++update.stats.refused;
      continue;
    }
    frame_.update(seen);
    found.push_back(proposal.edge);
    ++update.stats.accepted;
    ++k.seen_again;
  }
  query.T_MB = frame_.T_MW() * query.T_WB;
}

void LoopCloser::relocalise(MapKeyframe& query, const std::vector<Proposal>& proposals, std::vector<MapEdge>& found) {
  for (const Proposal& proposal : proposals) {
    const SeenPose seen = seen_pose(*map_.find(proposal.candidate), proposal.edge);
    const std::optional<Pose<M, W>> T_MW = relocaliser_.consider(query, seen.T_MB, proposal.verified);
    if (!T_MW) continue;
    frame_.reset(*T_MW, kFoundSigma_m, kFoundSigma_rad);
    frame_.update(seen);
    join_session(frame_.T_MW());
    query.T_MB = frame_.T_MW() * query.T_WB;
    query.placed = true;
    found.push_back(proposal.edge);
    return;
  }
}

/// What this session saw before it knew where it was now has a place in M.
void LoopCloser::join_session(const Pose<M, W>& T_MW) {
  for (MapKeyframe& k : map_.keyframes())
    if (k.session == session_.number) k.T_MB = T_MW * k.T_WB, k.placed = true;
  relocaliser_.forget();
}

void LoopCloser::add(MapKeyframe query, const std::vector<MapEdge>& found, MapUpdate& update) {
  std::optional<MapEdge> odometry;
  if (const MapKeyframe* previous = map_.find(session_.newest); previous != nullptr)
    odometry = odometry_edge(*previous, query.T_WB, query.t, options_.drift);
  const std::size_t size_before = map_.size();
  const Time t = query.t;
  const BowVector words = query.place.words;
  const KeyframeId id = map_.add(std::move(query));
  search_.add(id, words);
  if (odometry) odometry->to = id, map_.edges.push_back(*odometry);
  for (MapEdge e : found) {
    e.to = id;
    map_.edges.push_back(e);
    update.loops.push_back({e.from, id, e.T_from_to, e.information, 0});
  }
  loops_since_optimised_ += static_cast<int>(found.size());
  thinning_.note(id, found, size_before);
  flight_.add(t, id);
  session_.newest = id;
}

bool LoopCloser::optimisation_due() const {
  return frame_.known() && loops_since_optimised_ >= std::max(kOptimiseAfter, static_cast<int>(map_.size()) / kOptimiseShare);
}

void LoopCloser::optimise(MapUpdate& update) {
  map_.optimise({options_.degrees_of_freedom});
  loops_since_optimised_ = 0;
  if (const MapKeyframe* newest = map_.find(session_.newest); newest != nullptr && frame_.known()) {
    const Mat4 P = frame_.covariance();
    frame_.reset(newest->T_MB * newest->T_WB.inverse(), std::sqrt(P.topLeftCorner<3, 3>().trace() / 3), std::sqrt(P(3, 3)));
  }
  update.stats.optimised = true;
  for (const MapKeyframe& k : map_.keyframes()) update.corrected.push_back({k.id, k.t, k.T_MB});
}

PoseGraphReport LoopCloser::finish() { return map_.optimise({options_.degrees_of_freedom}); }

FinalAdjustmentReport LoopCloser::adjust() { return adjust_map(map_, verification_for(map_, options_.verification)); }

/// Poses that hung on the keyframe hang on its heir from now on; without one they go too.
void LoopCloser::take_out(KeyframeId id) {
  const MapKeyframe& gone = *map_.find(id);
  if (const MapKeyframe* heir = heir_of(map_, gone); heir != nullptr)
    flight_.hand_over(id, heir->id, heir->T_MB.inverse() * gone.T_MB);
  else flight_.drop(id);
  search_.remove(id, gone.place.words);
  map_.remove(id);
}

}  // namespace fbvins
