// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/loop_closer.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "fbvins/core/stage_timer.hpp"

namespace fbvins {
namespace {

constexpr double kRad = std::numbers::pi / 180;
/// Loops are many and never quite independent of one another.
constexpr double kLoopInflation = 2.0;
constexpr double kTiltSigma_rad = 0.005;
/// A guess of W in M is forgotten after this.
constexpr double kGuessLife_s = 5;
constexpr double kWidestPrediction_px = 45;

Mat6 symmetric(const Mat6& m) { return 0.5 * (m + m.transpose()); }

Pose<B, B> as_body(const Pose<B, C0>& T_BC0) { return {T_BC0.q, T_BC0.p}; }

double angle_between(const Quat& a, const Quat& b) { return 2 * std::acos(std::min(1.0, std::abs(a.dot(b)))); }

LoopOptions for_map(const PlaceMap& map, LoopOptions options) {
  if (map.boosted) options.verification = for_boosted(options.verification);
  return options;
}

}  // namespace

LoopCloser::LoopCloser(const StereoRig& rig, const LoopOptions& options, Vocabulary vocabulary)
    : LoopCloser(rig, options, std::move(vocabulary), PlaceMap{}) {}

LoopCloser::LoopCloser(const StereoRig& rig, const LoopOptions& options, Vocabulary vocabulary, PlaceMap map,
                       std::unique_ptr<DescriptorStage> stage)
    : options_(for_map(map, options)),
      T_BC0_(rig.T_BC0),
      vocabulary_(std::move(vocabulary)),
      extractor_(rig, options.extraction, vocabulary_, std::move(stage)),
      verifier_(options_.verification),
      map_(std::move(map)),
      index_(vocabulary_.words()),
      frame_(options.drift),
      follower_(options.follow_mps, options.follow_degps * kRad) {
  // Places hang on the camera; another rig's body lies elsewhere.
  const Pose<B, B> T_old_new = as_body(map_.T_BC0) * as_body(T_BC0_).inverse();
  for (MapKeyframe& k : map_.keyframes()) {
    if (!map_.empty() && T_old_new.p.norm() + angle_between(T_old_new.q, Quat::Identity()) > 1e-9) k.T_MB = k.T_MB * T_old_new;
    k.place.words = vocabulary_.words_of(k.place.descriptors);
    index_.add(k.id, k.place.words);
    session_ = std::max(session_, k.session);
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
  session_ += session_begun_ || !map_.empty();
  session_begun_ = true;
  reset_counter_ = reset_counter;
  previous_ = {};
  previous_T_WB_.reset();
  path_m_ = 0;
  guesses_.clear();
  frame_.forget();
  follower_.forget();
  if (map_.empty()) frame_.reset({}, 1e-3, 1e-4);
}

MapUpdate LoopCloser::process(Place place, FrameId frame, Time t, const Pose<W, B>& T_WB, std::uint32_t reset_counter) {
  if (!session_begun_ || reset_counter != reset_counter_) begin_session(reset_counter);
  MapUpdate update;
  update.frame = frame;
  update.t = t;
  update.reset_counter = reset_counter;
  if (previous_T_WB_) path_m_ += (T_WB.p - previous_T_WB_->p).norm();
  previous_T_WB_ = T_WB;
  frame_.advance(T_WB, t);

  MapKeyframe query{{}, t, session_, T_WB, frame_.T_MW() * T_WB, path_m_, 0, frame_.known(), std::move(place)};
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
  if (optimisation_due()) optimise(&update);
  thin();
  update.stats.optimise_ms = timer.lap_ms();
  update.stats.keyframes = static_cast<int>(map_.size());
  update.localised = frame_.known();
  update.map_session = session_;
  if (update.localised) {
    update.T_MW = frame_.T_MW();
    update.T_MW_smooth = follower_.follow(update.T_MW, T_WB, t);
  }
  return update;
}

/// Keyframes that could have been taken around here: near where the odometry says we are, looking the same way.
std::vector<KeyframeId> LoopCloser::plausible(const MapKeyframe& query) const {
  const double sigma = std::sqrt(frame_.covariance().topLeftCorner<3, 3>().trace());
  const double reach = options_.max_distance_m + 3 * sigma, min_cos = std::cos(options_.max_angle_deg * kRad);
  const Vec3 axis = query.T_MB.q * (T_BC0_.q * Vec3::UnitZ());
  std::vector<KeyframeId> ids;
  for (const MapKeyframe& k : map_.keyframes()) {
    if (!k.placed) continue;
    if (k.session == query.session && std::abs((query.t - k.t).seconds()) < options_.min_age_s) continue;
    if ((k.T_MB.p - query.T_MB.p).squaredNorm() > reach * reach) continue;
    if ((k.T_MB.q * (T_BC0_.q * Vec3::UnitZ())).dot(axis) < min_cos) continue;
    ids.push_back(k.id);
  }
  return ids;
}

/// The most similar ones, one of each group of neighbours in time.
std::vector<KeyframeId> LoopCloser::candidates_for(const MapKeyframe& query) {
  std::vector<IndexHit> hits;
  if (frame_.known()) {
    const std::vector<KeyframeId> near = plausible(query);
    hits = index_.query(query.place.words, 40, [&](KeyframeId k) { return std::binary_search(near.begin(), near.end(), k); });
  } else {
    hits = index_.query(query.place.words, 40, [&](KeyframeId k) { return map_.find(k)->placed; });
    // Several similar neighbours speak for a place.
    std::vector<IndexHit> grouped = hits;
    for (IndexHit& a : grouped)
      for (const IndexHit& b : hits)
        if (a.keyframe != b.keyframe &&
            std::abs((map_.find(a.keyframe)->t - map_.find(b.keyframe)->t).seconds()) < options_.group_s)
          a.similarity += 0.25f * b.similarity;
    std::stable_sort(grouped.begin(), grouped.end(),
                     [](const IndexHit& a, const IndexHit& b) { return a.similarity > b.similarity; });
    hits = std::move(grouped);
  }
  std::vector<KeyframeId> chosen;
  for (const IndexHit& hit : hits) {
    if (static_cast<int>(chosen.size()) == options_.candidates) break;
    const MapKeyframe& k = *map_.find(hit.keyframe);
    const bool covered = std::any_of(chosen.begin(), chosen.end(), [&](KeyframeId c) {
      const MapKeyframe& other = *map_.find(c);
      return other.session == k.session && std::abs((other.t - k.t).seconds()) < options_.group_s;
    });
    if (!covered) chosen.push_back(hit.keyframe);
  }
  return chosen;
}

std::vector<LoopCloser::Proposal> LoopCloser::look_at(const MapKeyframe& query, const std::vector<KeyframeId>& candidates) {
  std::vector<Proposal> proposals;
  if (candidates.empty()) return proposals;
  verifier_.set_query(query.place);
  const Mat4& P = frame_.covariance();
  const double sigma_m = std::sqrt(P.topLeftCorner<3, 3>().trace()), sigma_rad = std::sqrt(P(3, 3));
  const double radius_px = 10 + 3 * query.place.focal_px * (sigma_m / 2.0 + sigma_rad);
  for (const KeyframeId id : candidates) {
    const MapKeyframe& k = *map_.find(id);
    std::optional<VerifiedPose> verified;
    if (frame_.known() && radius_px < kWidestPrediction_px) {
      const Pose<M, C0> T_MQ = query.T_MB * T_BC0_, T_MK = k.T_MB * T_BC0_;
      verified = verifier_.verify(k.place, {T_MQ.inverse() * T_MK, radius_px});
    } else {
      verified = verifier_.verify(k.place);
    }
    if (verified) proposals.push_back({id, std::move(*verified)});
  }
  return proposals;
}

/// T_BcBq with the covariance of (dp in the candidate's body, dtheta in the query's), from the cameras' T_qc.
MapEdge LoopCloser::edge_to(KeyframeId query, const Proposal& proposal) const {
  const CameraFromCamera& T_qc = proposal.verified.pose.T_qc;
  const Pose<B, B> T_cq(T_qc.inverse().q, T_qc.inverse().p);  // of cameras; frames are told apart by the formulas here
  Mat6 J = Mat6::Zero();
  J.topLeftCorner<3, 3>() = -T_qc.R().transpose();
  J.topRightCorner<3, 3>() = hat(T_cq.p);
  J.bottomRightCorner<3, 3>() = -T_qc.R();
  const Mat6 cov_cq = kLoopInflation * J * proposal.verified.pose.information.inverse() * J.transpose();
  const Pose<B, B> T_BC = as_body(T_BC0_);
  Mat6 cov = compose_covariance(T_BC, Mat6::Zero(), T_cq, cov_cq);
  cov = compose_covariance(T_BC * T_cq, cov, T_BC.inverse(), Mat6::Zero());
  const double floor_m = options_.loop_floor_m, floor_rad = options_.loop_floor_deg * kRad;
  cov.diagonal().head<3>().array() += floor_m * floor_m;
  cov.diagonal().tail<3>().array() += floor_rad * floor_rad;
  return {proposal.candidate, query, T_BC * T_cq * T_BC.inverse(), symmetric(cov.inverse()), MapEdge::Kind::loop};
}

SeenPose LoopCloser::seen_pose(const Proposal& proposal) const {
  const MapKeyframe& k = *map_.find(proposal.candidate);
  const MapEdge edge = edge_to({}, proposal);
  SeenPose seen;
  seen.T_MB = k.T_MB * edge.T_from_to;
  const Mat6 cov = edge.information.inverse();
  const Mat3 R = k.T_MB.R(), R_q = seen.T_MB.R();
  // Position in M and the rotation's part about M's z.
  Eigen::Matrix<double, 4, 6> J = Eigen::Matrix<double, 4, 6>::Zero();
  J.topLeftCorner<3, 3>() = R;
  J.bottomRightCorner<1, 3>() = R_q.row(2);
  seen.covariance = J * cov * J.transpose();
  return seen;
}

void LoopCloser::close(MapKeyframe& query, const std::vector<Proposal>& proposals, MapUpdate& update,
                       std::vector<MapEdge>& found) {
  const double gate = options_.gate_sigma * options_.gate_sigma;
  for (const Proposal& proposal : proposals) {
    SeenPose seen = seen_pose(proposal);
    // Roll and pitch of the map and of the odometry differ a little; what the lever makes of it is not drift.
    const double lever = (map_.find(proposal.candidate)->T_MB.p - seen.T_MB.p).norm() * kTiltSigma_rad;
    seen.covariance.diagonal().head<3>().array() += lever * lever;
    if (frame_.mahalanobis2(seen) > gate) {
      ++update.stats.refused;
      continue;
    }
    frame_.update(seen);
    found.push_back(edge_to({}, proposal));
    ++update.stats.accepted;
    MapKeyframe& k = *map_.find(proposal.candidate);
    ++k.seen_again;
  }
  query.T_MB = frame_.T_MW() * query.T_WB;
}

/// The first two keyframes that agree where W is in M, or one that is beyond doubt.
void LoopCloser::relocalise(MapKeyframe& query, const std::vector<Proposal>& proposals, std::vector<MapEdge>& found) {
  std::erase_if(guesses_, [&](const Guess& g) { return (query.t - g.t).seconds() > kGuessLife_s; });
  for (const Proposal& proposal : proposals) {
    const Pose<M, B> T_MB = seen_pose(proposal).T_MB;
    const Pose<M, W> T_MW = T_MB * query.T_WB.inverse();
    const double yaw = yaw_of(T_MW.q);
    const Quat level(std::cos(0.5 * yaw), 0, 0, std::sin(0.5 * yaw));
    const Guess guess{query.t, {level, Vec3(T_MB.p - level * query.T_WB.p)}};
    const bool sure = static_cast<int>(proposal.verified.pose.inliers.size()) >= options_.sure_inliers &&
                      static_cast<int>(proposal.verified.pose.inliers.size()) > 0.35 * proposal.verified.visible;
    const bool agreed = std::any_of(guesses_.begin(), guesses_.end(), [&](const Guess& g) {
      return g.t != guess.t && (g.T_MW * query.T_WB.p - T_MB.p).norm() < options_.agree_m &&
             angle_between(g.T_MW.q, guess.T_MW.q) < options_.agree_deg * kRad;
    });
    if (!sure && !agreed) {
      guesses_.push_back(guess);
      continue;
    }
    frame_.reset(guess.T_MW, 0.05, 0.01);
    frame_.update(seen_pose(proposal));
    join_session(frame_.T_MW());
    query.T_MB = frame_.T_MW() * query.T_WB;
    query.placed = true;
    found.push_back(edge_to({}, proposal));
    return;
  }
}

/// What this session saw before it knew where it was now has a place in M.
void LoopCloser::join_session(const Pose<M, W>& T_MW) {
  for (MapKeyframe& k : map_.keyframes())
    if (k.session == session_) k.T_MB = T_MW * k.T_WB, k.placed = true;
  guesses_.clear();
}

void LoopCloser::add(MapKeyframe query, const std::vector<MapEdge>& found, MapUpdate& update) {
  const Pose<W, B> T_WB = query.T_WB;
  const Time t = query.t;
  const MapKeyframe* previous = previous_.valid() ? map_.find(previous_) : nullptr;
  const BowVector words = query.place.words;
  std::optional<MapEdge> odometry;
  if (previous != nullptr) {
    const Pose<B, B> T = previous->T_WB.inverse() * T_WB;
    const DriftVariance drift = drift_over(options_.drift, T.p.norm(), std::abs((t - previous->t).seconds()));
    Mat6 information = Mat6::Zero();
    // Variance of yaw in all three: a step is short, and roll and pitch drift less, not more.
    information.diagonal().head<3>().setConstant(1 / (drift.position_m2 + 1e-6));
    information.diagonal().tail<3>().setConstant(1 / (drift.yaw_rad2 + 1e-8));
    odometry = MapEdge{previous_, {}, T, information, MapEdge::Kind::odometry};
  }
  // The fuller the map, the less is new.
  const double scale = std::max(1.0, static_cast<double>(map_.size()) / options_.thin_above);
  const bool redundant = std::any_of(found.begin(), found.end(), [&](const MapEdge& e) {
    return e.T_from_to.p.norm() < scale * options_.redundant_m &&
           angle_between(e.T_from_to.q, Quat::Identity()) < scale * options_.redundant_deg * kRad;
  });
  const KeyframeId id = map_.add(std::move(query));
  index_.add(id, words);
  if (odometry) odometry->to = id, map_.edges.push_back(*odometry);
  for (MapEdge e : found) {
    e.to = id;
    map_.edges.push_back(e);
    update.loops.push_back({e.from, id, e.T_from_to, e.information, 0});
  }
  loops_since_optimised_ += static_cast<int>(found.size());
  if (redundant) redundant_.push_back(id);
  records_.push_back({t, id, {}, session_});
  previous_ = id;
  previous_t_ = t;
}

bool LoopCloser::optimisation_due() const {
  return frame_.known() && loops_since_optimised_ >= std::max(options_.optimise_after, static_cast<int>(map_.size()) / 4);
}

void LoopCloser::optimise(MapUpdate* update) {
  map_.optimise(options_.graph);
  loops_since_optimised_ = 0;
  const MapKeyframe* newest = previous_.valid() ? map_.find(previous_) : nullptr;
  if (newest != nullptr && frame_.known()) {
    const Mat4 P = frame_.covariance();
    frame_.reset(newest->T_MB * newest->T_WB.inverse(), std::sqrt(P.topLeftCorner<3, 3>().trace() / 3), std::sqrt(P(3, 3)));
  }
  if (update == nullptr) return;
  update->stats.optimised = true;
  for (const MapKeyframe& k : map_.keyframes()) update->corrected.push_back({k.id, k.t, k.T_MB});
}

PoseGraphReport LoopCloser::finish() { return map_.optimise(options_.graph); }

FinalAdjustmentReport LoopCloser::adjust() { return adjust_map(map_, options_.verification, options_.graph, options_.final_ba); }

/// Above its size the map lets go of keyframes that others replace, and above its limit of the oldest flight's.
void LoopCloser::thin() {
  constexpr std::size_t kKeepNewest = 20;
  while (static_cast<int>(map_.size()) > options_.thin_above && !redundant_.empty() && map_.size() > kKeepNewest &&
         redundant_.front() < map_.keyframes()[map_.size() - kKeepNewest].id) {
    const KeyframeId id = redundant_.front();
    redundant_.erase(redundant_.begin());
    if (map_.find(id) != nullptr) take_out(id);
  }
  // The first keyframe holds M, the newest ones are where the flight is; what lies between them may go.
  while (static_cast<int>(map_.size()) > options_.max_keyframes && map_.size() > 2) {
    // The one whose neighbours in time are nearest to one another says least.
    const auto& k = map_.keyframes();
    std::size_t least = 1;
    double smallest = 1e300;
    for (std::size_t i = 1; i + kKeepNewest < k.size(); ++i) {
      const double gap = (k[i + 1].T_MB.p - k[i - 1].T_MB.p).norm() + angle_between(k[i + 1].T_MB.q, k[i - 1].T_MB.q);
      if (gap < smallest) smallest = gap, least = i;
    }
    take_out(k[least].id);
  }
}

/// Who takes over the poses that hang on a keyframe: a neighbour of its session, else the last one before it that knows
/// where it is in M too. Null for a session's only keyframe while that is not known.
const MapKeyframe* LoopCloser::heir_of(const MapKeyframe& gone) const {
  const auto& all = map_.keyframes();
  const auto at = static_cast<std::size_t>(&gone - all.data());
  if (at > 0 && all[at - 1].session == gone.session) return &all[at - 1];
  if (at + 1 < all.size() && all[at + 1].session == gone.session) return &all[at + 1];
  for (std::size_t i = at; gone.placed && i-- > 0;)
    if (all[i].placed) return &all[i];
  return nullptr;
}

/// Always makes the map smaller. Poses that hung on the keyframe hang on its heir from now on; without one they go too.
void LoopCloser::take_out(KeyframeId id) {
  const MapKeyframe& gone = *map_.find(id);
  if (const MapKeyframe* heir = heir_of(gone); heir != nullptr) {
    const Pose<B, B> T_heir_gone = heir->T_MB.inverse() * gone.T_MB;
    for (Record& r : records_)
      if (r.anchor == id) r.anchor = heir->id, r.T_anchor_B = T_heir_gone * r.T_anchor_B;
  } else {
    std::erase_if(records_, [&](const Record& r) { return r.anchor == id; });
  }
  index_.remove(id, gone.place.words);
  map_.remove(id);
}

Trajectory LoopCloser::corrected(const Trajectory& in_W) const {
  struct Knot {
    Time t;
    Pose<M, B> T_MB;
    Pose<W, B> T_WB;
  };
  std::vector<Knot> knots;
  for (const Record& r : records_) {
    const MapKeyframe* anchor = map_.find(r.anchor);
    const auto at = std::lower_bound(in_W.begin(), in_W.end(), r.t, [](const StampedPose& p, Time t) { return p.t < t; });
    if (anchor == nullptr || !anchor->placed || at == in_W.end() || at->t != r.t) continue;
    knots.push_back({r.t, anchor->T_MB * r.T_anchor_B, at->T_WB});
  }
  Trajectory out;
  if (knots.empty()) return out;
  std::size_t k = 0;
  for (const StampedPose& p : in_W) {
    while (k + 1 < knots.size() && knots[k + 1].t <= p.t) ++k;
    const Pose<M, B> a = knots[k].T_MB * (knots[k].T_WB.inverse() * p.T_WB);
    Pose<M, B> T_MB = a;
    if (k + 1 < knots.size() && p.t > knots[k].t) {
      const Pose<M, B> b = knots[k + 1].T_MB * (knots[k + 1].T_WB.inverse() * p.T_WB);
      const double s = (p.t - knots[k].t).seconds() / (knots[k + 1].t - knots[k].t).seconds();
      T_MB = {a.q.slerp(s, b.q), Vec3((1 - s) * a.p + s * b.p)};
    }
    out.push_back({p.t, T_MB.cast_frames<W, B>()});
  }
  return out;
}

}  // namespace fbvins
