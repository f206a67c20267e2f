// SPDX-License-Identifier: Apache-2.0
// The part of LoopCloser that says how M lies: level (docs/derivations/loop.md, L28), and tied to a building (L21-L25).
#include <algorithm>
#include <cmath>

#include "fbvins/loop/anchor_fit.hpp"
#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_edges.hpp"

namespace fbvins {
namespace {

/// Anchors of one keyframe: of a sensor that is faster, some are left out, evenly.
constexpr std::size_t kMostOfAKeyframe = 8;
/// Anchors by which M is found: of more, evenly so many.
constexpr std::size_t kMostToFind = 400;
/// Anchors share the error of the vertical, so that it counts times the root of their number, but of at most so many.
constexpr std::size_t kMostAlike = 16;
/// A new M is levelled anew where it leans by more than this, and by more than so many standard deviations of the vertical.
constexpr double kLeaning_rad = 0.25 * kDegree, kLeaningSigmas = 3;

Vec6 sigma_of(double position_m2, double yaw_rad2) {
  Vec6 sigma;
  sigma << Vec3::Constant(std::sqrt(position_m2)), Vec3::Constant(std::sqrt(yaw_rad2));
  return sigma;
}

}  // namespace

/// Takes the newest estimate of gravity, and of an older map's vertical. Verticals of keyframes follow it at once; M, where the
/// flight began it, once it leans enough.
std::optional<Pose<M, M>> LoopCloser::level(const GaugeState& gauge) {
  const LevelledGauge now = session_.measured_level(gauge);
  frame_.set_tilt_sigma(std::max(kTilt_rad, now.up_sigma_rad));
  if (now.q_LG.coeffs() != session_.q_LG_newest().coeffs()) map_.level(session_.number(), now.q_LG);
  session_.take_level(now);
  const bool may_lean = session_.began_map() && map_.anchors.empty() && options_.degrees_of_freedom == 4;
  const double leaning = std::max(kLeaning_rad, kLeaningSigmas * now.up_sigma_rad);
  if (may_lean && angle_between(now.q_LG, session_.q_LG()) <= leaning) return std::nullopt;
  return level_by_newest();
}

/// From a new M to where it will be once it is levelled: about its first keyframe, which defines it.
Pose<M, M> LoopCloser::to_upright() const {
  if (session_.is_level() || map_.empty()) return {};
  const Quat turned = session_.q_LG_newest() * session_.q_LG().conjugate();
  const Vec3 first = map_.keyframes()[0].T_MB.p;
  return {turned, Vec3(first - turned * first)};
}

/// Where the flight began the map, M is turned as a whole, which changes no relative pose; where anchors hold it, the body stays
/// where it is. Where the flight has joined an older one, M is gravity-aligned already, and the flight's own keyframes are
/// rotated. Returns how M moved, unless anchors hold it.
std::optional<Pose<M, M>> LoopCloser::level_by_newest() {
  if (session_.is_level()) return std::nullopt;
  const Pose<M, M> upright = to_upright();
  const Quat turned_in_M = frame_.yaw() * upright.q * frame_.yaw().conjugate();
  session_.level_by_newest();
  std::optional<Pose<M, M>> moved;
  if (session_.began_map() && !map_.empty()) {
    if (map_.anchored) frame_.turn(map_.turn(turned_in_M, frame_.T_MG() * session_.gauge().T_GB.p));
    else map_.move(upright), frame_.turn(upright), moved = upright;
  } else {
    for (auto k = map_.keyframes().rbegin(); k != map_.keyframes().rend() && k->session == session_.number(); ++k)
      k->T_MB.q = (turned_in_M * k->T_MB.q).normalized();
  }
  frame_.level(session_.q_LG());
  return moved;
}

/// Attached to the newest keyframe of the map, by the odometry's motion between the two.
std::optional<MapAnchor> LoopCloser::attached(const Anchor& anchor) const {
  const MapKeyframe* newest = map_.find(session_.newest());
  const std::optional<Pose<G, B>> T_GB = session_.motion().at(stamp_of(anchor));
  if (newest == nullptr || !T_GB) return std::nullopt;
  const Pose<B, B> T = newest->T_GB.inverse() * *T_GB;
  const DriftVariance drift = drift_over(session_.drift(), T.p.norm(), std::abs((stamp_of(anchor) - newest->t).seconds()));
  const Mat6 covariance = sigma_of(drift.position_m2, drift.yaw_rad2).cwiseAbs2().asDiagonal();
  return MapAnchor{newest->id, carried(measurement_of(anchor), T, covariance)};
}

/// All anchors are kept, also those that contradict the present estimate: the graph finds which of them are wrong.
void LoopCloser::take_anchors(const Keyframe& keyframe, MapUpdate& update) {
  const double gate = options_.gate_sigma * options_.gate_sigma;
  std::vector<const Anchor*> anchors;
  for (const Anchor& anchor : keyframe.anchors)
    if (const auto* tag = std::get_if<TagAnchor>(&anchor); tag == nullptr || tag->has_place()) anchors.push_back(&anchor);
  const std::size_t count = anchors.size(), most = std::min(count, kMostOfAKeyframe);
  bool taken = false;
  for (std::size_t i = 0; i < most; ++i) {
    const std::optional<MapAnchor> anchor = attached(*anchors[i * count / most]);
    if (!anchor) {
      ++update.stats.anchors_refused;
      continue;
    }
    taken = true;
    map_.add_anchor(*anchor);
    if (!map_.anchored || !frame_.known()) continue;
    const Pose<G, B>& T_GB = map_.find(anchor->keyframe)->T_GB;
    const bool fits = frame_.mahalanobis2(anchor->measured, T_GB) < gate;
    if (fits) frame_.update(anchor->measured, T_GB);
    ++(fits ? update.stats.anchors : update.stats.anchors_refused);
  }
  if (!taken) return;
  if (!map_.anchored || !frame_.known()) find_building(update);
  if (!map_.anchored || !frame_.known()) return;
  ++news_since_optimised_;
  MapKeyframe& newest = *map_.find(session_.newest());
  if (newest.t == keyframe.t) newest.T_MB = frame_.T_MG() * newest.T_GB;
}

/// What an anchor says of a pose in M or, of a flight that is not localised in an anchored map, in its own gauge, level.
AnchoredPose LoopCloser::anchored_pose(const MapAnchor& anchor) const {
  const MapKeyframe& k = *map_.find(anchor.keyframe);
  AnchoredPose pose{k.T_MB.q, k.T_MB.p, anchor.measured, k.id};
  if (map_.anchored) pose.q_XB = session_.q_LG() * k.T_GB.q, pose.p_XB = session_.q_LG() * k.T_GB.p;
  if (k.session != session_.number()) return pose;
  const DriftVariance drift =
      drift_over(session_.drift(), session_.path_m() - k.path_m, (session_.motion().newest() - k.t).seconds());
  const double away_m2 = (session_.gauge().T_GB.p - k.T_GB.p).squaredNorm();
  pose.measured.information =
      widened(pose.measured.information, sigma_of(drift.position_m2 + drift.yaw_rad2 * away_m2, drift.yaw_rad2).asDiagonal());
  return pose;
}

std::vector<AnchoredPose> LoopCloser::anchored_poses() const {
  std::vector<const MapAnchor*> usable;
  for (const MapAnchor& anchor : map_.anchors) {
    const MapKeyframe& k = *map_.find(anchor.keyframe);
    if (map_.anchored ? k.session == session_.number() : k.placed) usable.push_back(&anchor);
  }
  std::vector<AnchoredPose> poses;
  const std::size_t count = std::min(usable.size(), kMostToFind);
  // The vertical is wrong by the same for all of them: their mean is no better than one.
  const double shared = std::sqrt(static_cast<double>(std::min(count, kMostAlike)));
  for (std::size_t i = 0; i < count; ++i) {
    poses.push_back(anchored_pose(*usable[i * usable.size() / count]));
    poses.back().tilt_rad = std::max(kTilt_rad, shared * session_.up_sigma_rad());
  }
  return poses;
}

/// Where M lies in the building or, once that is known, where a flight that is not localised lies in M.
void LoopCloser::find_building(MapUpdate& update) {
  if (map_.anchored == frame_.known()) return;  // a flight that is not localised in M says nothing of M
  const Pose<G, B>& T_GB = session_.gauge().T_GB;
  const std::optional<AnchorFit> fit =
      fit_anchors(anchored_poses(), frame_.known() ? frame_.T_MG() * T_GB.p : Vec3(session_.q_LG() * T_GB.p));
  if (!fit) return;
  const double sigma_m = std::sqrt(fit->covariance.topLeftCorner<3, 3>().trace() / 3);
  const double sigma_rad = std::sqrt(fit->covariance(3, 3));
  if (frame_.known()) {
    const Pose<M, M> T(fit->q_AX, fit->p_AX);
    map_.move(T);
    map_.anchored = true;
    frame_.reset(T * frame_.T_MG(), sigma_m, sigma_rad);
    follower_.forget();
    update.M_moved = update.M_moved ? T * *update.M_moved : T;
  } else {
    frame_.reset({fit->q_AX * session_.q_LG(), fit->p_AX}, sigma_m, sigma_rad);
    join_session(frame_.T_MG());
  }
  optimise(update);
}

}  // namespace fbvins
