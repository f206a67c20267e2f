// SPDX-License-Identifier: Apache-2.0
// Landmarks that have left the window, where they were, and how well that is known
// (docs/derivations/known_landmarks.md, K1-K6). One that comes into the window again under its old track holds the window to W.
//
// Each is known relative to the map around it, which drifted as one: what it has in common is kept once for all
// landmarks of a moment, as an anchor, and is part of what W is uncertain of from then on.
// Synchronous; one instance, one thread. At most `capacity` landmarks: the oldest are forgotten.
//
//   known.hold_to(T_WB.p, priors_in_use);                         // after each solve
//   covariance = known.with_map(T_WB, covariance);                 // of any pose of the window
//   known.anchor(T_WB_leaving, covariance);                        // before a keyframe leaves
//   known.remember(track, T_WC, point, V);                         // when a landmark leaves
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
  /// The window is held to the map by these, around the newest position.
  void hold_to(const Vec3& p_W, std::span<const LandmarkPrior> in_use);
  /// Covariance of (dp in W, dtheta in B) of a pose: of the window alone, and with that of the remembered landmarks (K4-K6).
  Mat6 with_map(const Pose<W, B>& T_WB, const Mat6& window_covariance) const;
  /// Landmarks remembered from now on have in common what this pose, their host's, is uncertain of.
  void anchor(const Pose<W, B>& T_WB, const Mat6& window_covariance);
  /// A landmark leaves: its host's camera, (alpha, beta, rho) and their information given the poses. The first time counts,
  /// it has drifted least; not one whose depth is too uncertain.
  void remember(TrackId track, const Pose<W, C0>& T_WC, const Vec3& alpha_beta_rho, const Mat3& information);
  std::optional<LandmarkPrior> find(TrackId track) const;
  void forget(TrackId track);
  /// Those remembered since the last call.
  std::vector<LocatedLandmark> take_new() { return std::exchange(new_, {}); }

  std::size_t size() const { return priors_.size(); }

 private:
  struct Anchor {
    Vec3 p_W = Vec3::Zero();
    Mat6 covariance = Mat6::Zero();  // (dp, dtheta) in W
  };
  static Mat6 carried(const Anchor& anchor, const Vec3& p_W);
  void make_room();

  KnownLandmarkOptions options_;
  std::unordered_map<TrackId, LandmarkPrior> priors_;
  std::deque<TrackId> order_;      // as remembered
  std::deque<Anchor> anchors_;     // of the landmarks remembered, oldest first
  std::int64_t first_anchor_ = 0;  // number of the oldest
  Anchor next_;                    // of those remembered next
  Anchor held_to_;                 // what the newest pose is held to
  bool in_use_ = false;            // any landmark in the window is known from before
  std::vector<LocatedLandmark> new_;
};

}  // namespace fbvins
