// SPDX-License-Identifier: Apache-2.0
// Landmarks that have left the window: their positions and covariances (docs/derivations/known_landmarks.md, K1-K6).
// One that comes into the window again under its old track constrains the window by its prior.
//
// A landmark's covariance is relative to the map around it, which has drifted as a whole. The common covariance is kept once
// for all landmarks of a moment, as the position and covariance of their hosts, and is added to that of every pose that such
// landmarks constrain. Synchronous; one instance, one thread. At most `capacity` landmarks: the oldest are forgotten.
//
//   known.set_active_priors(T_GB.p, priors_in_use);                         // after each solve
//   covariance = known.with_map_covariance(T_GB, covariance);                 // of any pose of the window
//   known.set_host_uncertainty(T_GB_leaving, covariance);                        // before a keyframe leaves
//   known.remember(track, T_GC, point, V);                         // when a landmark leaves
//   landmark.prior = known.find(track);                           // when a track appears
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fbvins/estimator/estimator_options.hpp"
#include "fbvins/estimator/landmark_prior.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

class KnownLandmarks {
 public:
  explicit KnownLandmarks(const KnownLandmarkOptions& options) : options_(options) {}

  void clear();
  /// Sets the priors by which the map constrains the window, and the newest position.
  void set_active_priors(const Vec3& p_G, std::span<const LandmarkPrior> in_use);
  /// Covariance of (dp in G, dtheta in B) of a pose: that of the window alone, plus that of the map in use (K4-K6).
  Mat6 with_map_covariance(const Pose<G, B>& T_GB, const Mat6& window_covariance) const;
  /// Landmarks remembered from now on have the uncertainty of this pose, their host's, in common.
  void set_host_uncertainty(const Pose<G, B>& T_GB, const Mat6& window_covariance);
  /// A landmark leaves: its host's camera, (alpha, beta, rho) and their information given the poses. Ignored for a landmark
  /// that is known already, since the first position has drifted least, and for one whose depth is too uncertain.
  void remember(TrackId track, const Pose<G, C0>& T_GC, const Vec3& alpha_beta_rho, const Mat3& information);
  std::optional<LandmarkPrior> find(TrackId track) const;
  void forget(TrackId track);
  /// Those remembered since the last call.
  std::vector<LocatedLandmark> take_new() { return std::exchange(new_, {}); }

  std::size_t size() const { return priors_.size(); }

 private:
  struct MapUncertainty {
    Vec3 p_G = Vec3::Zero();
    Mat6 covariance = Mat6::Zero();  // (dp, dtheta) in G
  };
  static Mat6 propagated(const MapUncertainty& then, const Vec3& p_G);
  void make_room();

  KnownLandmarkOptions options_;
  std::unordered_map<TrackId, LandmarkPrior> priors_;
  std::deque<TrackId> order_;                 // oldest first
  std::deque<MapUncertainty> uncertainties_;  // of the landmarks remembered, oldest first
  std::int64_t first_uncertainty_ = 0;        // number of the oldest
  MapUncertainty next_;                       // of those remembered next
  MapUncertainty active_;                     // mean of those in use, at the newest position (K6)
  bool in_use_ = false;                       // whether any landmark in the window has a prior
  std::vector<LocatedLandmark> new_;
};

}  // namespace fbvins
