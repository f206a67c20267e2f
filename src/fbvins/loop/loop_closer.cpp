// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/loop_closer.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/stage_timer.hpp"
#include "fbvins/loop/final_adjustment.hpp"
#include "fbvins/loop/map_edges.hpp"
#include "fbvins/loop/map_sessions.hpp"
#include "fbvins/loop/map_upkeep.hpp"

namespace fbvins {
namespace {

/// A new map begins as the gauge of its first flight, aligned with gravity.
constexpr double kNewMapSigma_m = 1e-3, kNewMapSigma_rad = 1e-4;
/// Search radius around a predicted feature: the narrowest plus three standard deviations (for a point at a typical depth);
/// from the widest on the prediction is not used.
constexpr double kNarrowestPrediction_px = 10, kPredictionSigmas = 3, kTypicalDepth_m = 2, kWidestPrediction_px = 45;
/// New loops and keyframes with anchors after which the graph is optimised; in a large map one for every kOptimiseShare
/// keyframes.
constexpr int kOptimiseAfter = 24, kOptimiseShare = 4;
/// A keyframe this near the newest of the map, in position and in attitude, sees what that one sees.
constexpr double kSamePlace_m = 0.12, kSamePlace_rad = 7 * kDegree;

/// Fastest motion and turn of the smooth T_MW (L14).
constexpr double kFollow_mps = 0.15, kFollow_radps = 3 * kDegree;

double position_sigma_m(const Mat4& P) { return std::sqrt(P.topLeftCorner<3, 3>().trace()); }

/// Places belong to the camera; another rig may have its body elsewhere.
PlaceMap with_body(PlaceMap map, const Pose<B, C0>& T_BC0) {
  change_body(map, T_BC0);
  remember_sessions(map);
  return map;
}

PlaceVerifierOptions verification_for(const PlaceMap& map, const PlaceVerifierOptions& options) {
  return map.boosted ? for_boosted(options) : options;
}

}  // namespace

LoopCloser::LoopCloser(const StereoRig& rig, const LoopOptions& options, Vocabulary vocabulary)
    : LoopCloser(rig, options, std::move(vocabulary), PlaceMap{}) {}

LoopCloser::LoopCloser(const StereoRig& rig, const LoopOptions& options, Vocabulary vocabulary, PlaceMap map,
                       std::unique_ptr<DescriptorStage> stage)
    : options_(options),
      cameras_(rig, options.extraction, vocabulary, std::move(stage)),
      verifier_(verification_for(map, options.verification)),
      map_(with_body(std::move(map), cameras_.T_BC(0))),
      search_(vocabulary.words(), options.max_distance_m),
      join_(map_),
      follower_(kFollow_mps, kFollow_radps),
      thinning_(options.thin_above, options.max_keyframes, map_) {
  map_.fill_words(vocabulary);
  if (map_.store) search_.add(map_.store);
  for (const MapKeyframe& k : map_.keyframes())
    if (k.stored < 0) search_.add(k.id, k.place.words);
  map_.anchored = map_.anchored && !map_.empty();
}

/// Whether a keyframe would add nothing to the map, in which the flight knows where it is: it shows the camera's newest place, or
/// none, because no camera by which places are recognised delivered an image.
bool LoopCloser::adds_nothing(const Keyframe& keyframe, std::optional<std::size_t> camera) const {
  if (!session_.has(keyframe) || !frame_.known()) return false;
  if (!camera) return true;
  const MapKeyframe* newest = map_.find(session_.newest_of(*camera));
  if (newest == nullptr) return false;
  const Pose<B, B> moved = newest->T_GB.inverse() * keyframe.gauge.T_GB;
  return moved.p.norm() < kSamePlace_m && angle_between(moved.q, Quat::Identity()) < kSamePlace_rad;
}

MapUpdate LoopCloser::process(const Keyframe& keyframe) {
  const std::optional<std::size_t> camera = cameras_.next(keyframe.images);
  if (adds_nothing(keyframe, camera)) {
    MapUpdate update = begin_update(keyframe);
    advance(keyframe);
    take_anchors(keyframe, update);
    end_update(keyframe, update);
    return update;
  }
  CpuTimer timer;
  Place place = cameras_.extract(camera.value_or(0), keyframe);
  const double extract_ms = timer.lap_ms();
  MapUpdate update = process(std::move(place), keyframe, camera.value_or(0));
  update.stats.extract_ms = extract_ms;
  return update;
}

void LoopCloser::begin_session(const Keyframe& keyframe) {
  const std::uint32_t number = session_.begun() ? session_.number() + 1 : join_.first_session();
  session_ = FlightSession(keyframe, number, map_.empty(), options_.drift, cameras_.size());
  relocaliser_.forget();
  frame_.forget();
  follower_.forget();
  frame_.level(session_.q_LG());
  if (map_.empty()) frame_.reset({session_.q_LG(), Vec3::Zero()}, kNewMapSigma_m, kNewMapSigma_rad);
}

/// Path, drift and readings up to a keyframe, and what they make of the map frame.
void LoopCloser::advance(const Keyframe& keyframe) {
  const MapKeyframe* newest = map_.find(session_.newest());
  session_.advance(keyframe, newest ? std::optional(newest->t) : std::nullopt);
  frame_.advance(keyframe.gauge.T_GB, keyframe.t, session_.drift(), session_.began_map() ? 0 : keyframe.scale_sigma);
}

MapKeyframe LoopCloser::query_of(Place place, const Keyframe& keyframe, std::size_t camera) {
  advance(keyframe);
  const Pose<G, B>& T_GB = keyframe.gauge.T_GB;
  MapKeyframe query;
  query.t = keyframe.t;
  query.session = session_.number();
  query.T_GB = T_GB;
  query.T_MB = frame_.T_MG() * T_GB;
  query.path_m = session_.path_m();
  query.placed = frame_.known();
  query.camera = map_.camera_at(cameras_.T_BC(camera));
  query.place = std::move(place);
  query.motion = {keyframe.gauge.v_GB, keyframe.imu.bias};
  return query;
}

MapUpdate LoopCloser::begin_update(const Keyframe& keyframe) {
  MapUpdate update;
  if (session_.has(keyframe)) {
    update.M_moved = level(keyframe.gauge);
  } else {
    update.M_moved = level_by_newest();  // of the session that ends
    begin_session(keyframe);
  }
  map_.gravity_mps2 = keyframe.imu.gravity_mps2;
  update.frame = keyframe.id;
  update.t = keyframe.t;
  update.reset_counter = keyframe.reset_counter;
  return update;
}

void LoopCloser::end_update(const Keyframe& keyframe, MapUpdate& update) {
  update.stats.keyframes = static_cast<int>(map_.size());
  update.localised = frame_.known();
  update.map_session = session_.number();
  update.anchored = map_.anchored;
  update.found = session_.note_localised(update.localised);
  if (!update.localised) return;
  update.T_MG = frame_.T_MG();
  update.T_MW = update.T_MG * keyframe.T_WG.inverse();
  update.T_MW_smooth = follower_.follow(to_upright() * update.T_MW, keyframe.T_WG * keyframe.gauge.T_GB, keyframe.t);
}

MapUpdate LoopCloser::process(Place place, const Keyframe& keyframe, std::size_t camera) {
  MapUpdate update = begin_update(keyframe);
  MapKeyframe query = query_of(std::move(place), keyframe, camera);
  CpuTimer timer;
  const std::vector<KeyframeId> candidates = candidates_for(query);
  update.stats.recognise_ms = timer.lap_ms();
  const std::vector<Proposal> proposals = look_at(query, candidates);
  std::vector<MapEdge> found;
  if (frame_.known()) close(query, proposals, update, found);
  else relocalise(query, proposals, found);
  update.stats.verify_ms = timer.lap_ms();
  update.stats.candidates = static_cast<int>(candidates.size());
  add(std::move(query), camera, keyframe.imu, found, update);
  take_tags(keyframe, update);
  take_anchors(keyframe, update);
  if (optimisation_due()) optimise(update);
  while (const auto id = thinning_.next(map_)) take_out(*id);
  update.stats.optimise_ms = timer.lap_ms();
  end_update(keyframe, update);
  return update;
}

std::vector<KeyframeId> LoopCloser::candidates_for(const MapKeyframe& query) {
  return frame_.known() ? search_.around(map_, query, position_sigma_m(frame_.covariance())) : search_.anywhere(map_, query);
}

/// Length in M of what the flight and this keyframe measure together as 1 m.
double LoopCloser::metres_with(const MapKeyframe& k) const {
  const double log = frame_.log_scale() + map_.log_scale_of(k.session);
  return log == 0 ? 1 : std::exp(0.5 * log);
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
      verified = verifier_.verify(*map_.place_of(k), {map_.T_MC(query).inverse() * map_.T_MC(k), radius_px});
    } else {
      verified = verifier_.verify(*map_.place_of(k));
    }
    if (!verified) continue;
    const MapEdge edge = loop_edge(map_.T_BC(k), map_.T_BC(query), id, verified->pose);
    proposals.push_back({id, std::move(*verified), edge});
  }
  return proposals;
}

/// What a place or a tag that was seen before says of the body, unless it contradicts the odometry.
bool LoopCloser::take(const MapKeyframe& k, MeasuredPose seen) {
  // The error that different roll and pitch cause through the lever arm is not drift.
  double tilt_variance = kMapTilt_rad * kMapTilt_rad;
  if (k.session != session_.number()) tilt_variance += session_.up_sigma_rad() * session_.up_sigma_rad();
  seen.covariance.diagonal().head<3>().array() += (k.T_MB.p - seen.T_MB.p).squaredNorm() * tilt_variance;
  if (frame_.mahalanobis2(seen) > options_.gate_sigma * options_.gate_sigma) return false;
  if (k.session != session_.number()) session_.see(seen);
  if (k.session == session_.number() || session_.needs_scale()) seen.covariance *= kSharedError;
  frame_.update(seen);
  return true;
}

void LoopCloser::close(MapKeyframe& query, const std::vector<Proposal>& proposals, MapUpdate& update,
                       std::vector<MapEdge>& found) {
  for (const Proposal& proposal : proposals) {
    MapKeyframe& k = *map_.find(proposal.candidate);
    const MeasuredPose seen = measured_pose(k, proposal.edge, metres_with(k));
    if (take(k, seen)) {
      session_.confirm();
    } else if (!find_again(query, proposal, seen)) {
      ++update.stats.refused;
      join_.note_refused(session_.number(), 1);
      continue;
    }
    found.push_back(proposal.edge);
    ++update.stats.accepted;
    ++k.loops_ending_here;
  }
  query.T_MB = frame_.T_MG() * query.T_GB;
}

/// From the newest keyframe of the map to `t`; null where readings are missing on the way, or keyframes in between.
void LoopCloser::add(MapKeyframe query, std::size_t camera, const KeyframeImu& imu, const std::vector<MapEdge>& found,
                     MapUpdate& update) {
  std::optional<MapEdge> odometry;
  if (const MapKeyframe* previous = map_.find(session_.newest()); previous != nullptr) {
    odometry = odometry_edge(*previous, query.T_GB, query.t, session_.drift());
    if (odometry) odometry->imu = session_.readings_until(query.t, previous->t, imu);
  }
  session_.restart_readings();
  const std::size_t size_before = map_.size();
  const Time t = query.t;
  const BowVector words = query.place.words;
  MapSession& session = map_.session(session_.number(), t);
  session.ended = t;
  session.scale_sigma = session_.scale_sigma();
  ++session.keyframes;
  session.loops += static_cast<int>(
      std::ranges::count_if(found, [&](const MapEdge& e) { return map_.find(e.from)->session != session_.number(); }));
  const KeyframeId id = map_.add(std::move(query));
  search_.add(id, words);
  if (odometry) odometry->to = id, map_.edges.push_back(*odometry);
  for (MapEdge e : found) {
    e.to = id;
    map_.edges.push_back(e);
    update.loops.push_back({e.from, id, e.T_from_to, e.information, 0});
  }
  news_since_optimised_ += static_cast<int>(found.size());
  thinning_.note(id, found, size_before);
  flight_.add(t, id);
  session_.added(id, camera);
}

bool LoopCloser::optimisation_due() const {
  return frame_.known() && news_since_optimised_ >= std::max(kOptimiseAfter, static_cast<int>(map_.size()) / kOptimiseShare);
}

/// Without anchors the measurements leave it open where M lies. It stays where its keyframes move least, and not with the first
/// of them: those of a flight's first seconds err most, and a loop back to them would move all that came after. An older map
/// stays where its own keyframes do, which the flight's must not drag along.
PoseGraphReport LoopCloser::optimise_graph() {
  const auto poses = [this] {
    std::vector<Pose<M, B>> held;
    for (const MapKeyframe& k : map_.keyframes())
      if (k.placed && (join_.began_map() || !join_.is_of_flight(k.session))) held.push_back(k.T_MB);
    return held;
  };
  const std::vector<Pose<M, B>> before = poses();
  const PoseGraphReport report = map_.optimise({options_.degrees_of_freedom});
  if (!map_.anchored) map_.move(nearest_to(before, poses(), kTypicalDepth_m));
  return report;
}

void LoopCloser::optimise(MapUpdate& update) {
  optimise_graph();
  news_since_optimised_ = 0;
  if (const MapKeyframe* newest = map_.find(session_.newest()); newest != nullptr && frame_.known()) {
    const Mat4 P = frame_.covariance();
    frame_.reset(newest->T_MB * newest->T_GB.inverse(), std::sqrt(P.topLeftCorner<3, 3>().trace() / 3), std::sqrt(P(3, 3)));
    if (!session_.began_map()) frame_.set_log_scale(map_.log_scale_of(session_.number()));
  }
  update.stats.optimised = true;
  for (const MapKeyframe& k : map_.keyframes()) update.corrected.push_back({k.id, k.t, k.T_MB});
}

PoseGraphReport LoopCloser::finish() {
  level_by_newest();
  const bool localised =
      std::ranges::any_of(map_.keyframes(), [&](const MapKeyframe& k) { return k.placed && join_.is_of_flight(k.session); });
  if (!localised) return {};  // the older map stays as it was
  const PoseGraphReport report = optimise_graph();
  upkeep();
  return report;
}

/// Judges the flight's sessions. From a map that was flown in before, what those that join it make superfluous is removed.
void LoopCloser::upkeep() {
  if (verdict_) return;
  verdict_ = join_.objections(map_);
  if (join_.began_map()) return;
  std::set<std::uint32_t> flown;
  for (const MapKeyframe& k : map_.keyframes())
    if (k.placed && join_.is_of_flight(k.session) && verdict_->count(k.session) == 0) flown.insert(k.session);
  if (flown.empty()) return;
  for (const KeyframeId id : what_leaves(map_, flown, verifier_)) take_out(id);
  thinning_.end_flight();
  while (const auto id = thinning_.next(map_)) take_out(*id);
}

std::optional<PlaceMap> LoopCloser::reduced() const {
  std::set<std::uint32_t> gone;
  for (const auto& [session, why] : objections()) gone.insert(session);
  return gone.empty() ? std::nullopt : std::optional(join_.without(map_, gone));
}

FinalAdjustmentReport LoopCloser::adjust() { return adjust_map(map_, verification_for(map_, options_.verification)); }

/// Poses attached to the keyframe are attached to its successor; without one they are dropped.
void LoopCloser::take_out(KeyframeId id) {
  const MapKeyframe& gone = *map_.find(id);
  if (const MapKeyframe* successor = successor_of(map_, gone); successor != nullptr)
    flight_.hand_over(id, successor->id, successor->T_MB.inverse() * gone.T_MB);
  else flight_.drop(id);
  search_.remove(id, gone.place.words);
  map_.remove(id);
}

}  // namespace fbvins
